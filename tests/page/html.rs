//! A strict parser of the HTML that is well-formed by any reading: every element is closed, but for
//! the void ones; every attribute is quoted; every `&` begins a reference that is known.

/// An element, or a run of text (without a name).
#[derive(Debug, Default)]
pub struct Element {
    pub name: String,
    pub attributes: Vec<(String, String)>,
    pub inside: Vec<Element>,
    words: String,
}

const VOID: [&str; 4] = ["meta", "link", "img", "br"];
const KNOWN: [(&str, char); 5] = [
    ("&amp;", '&'),
    ("&lt;", '<'),
    ("&gt;", '>'),
    ("&quot;", '"'),
    ("&#39;", '\''),
];

impl Element {
    /// This element and all below it that fit, in their order.
    pub fn all(&self, fits: impl Fn(&Element) -> bool) -> Vec<&Element> {
        let mut found = Vec::new();
        let mut waiting = vec![self];
        while let Some(element) = waiting.pop() {
            if !element.name.is_empty() && fits(element) {
                found.push(element);
            }
            waiting.extend(element.inside.iter().rev());
        }
        found
    }

    pub fn attribute(&self, key: &str) -> Option<String> {
        let found = self.attributes.iter().find(|(k, _)| k == key);
        found.map(|(_, value)| value.clone())
    }

    /// All text within.
    pub fn text(&self) -> String {
        let inside: Vec<String> = self.inside.iter().map(Element::text).collect();
        self.words.clone() + &inside.concat()
    }
}

/// The whole page under one element without meaning.
pub fn parse(text: &str) -> Result<Element, String> {
    let mut rest = text.strip_prefix("<!DOCTYPE html>\n").ok_or("no doctype")?;
    let mut open = vec![Element {
        name: "page".into(),
        ..Element::default()
    }];
    while !rest.is_empty() {
        let top = open.len() - 1;
        if open[top].name == "style" && !rest.starts_with("</style>") {
            let end = rest.find("</style>").ok_or("style is not closed")?;
            rest = &rest[end..];
        } else if let Some(tag) = rest.strip_prefix("</") {
            let (name, after) = tag.split_once('>').ok_or("a tag is not closed")?;
            let element = open.pop().ok_or("nothing is open")?;
            if element.name != name {
                return Err(format!("{name} closes {}", element.name));
            }
            open.last_mut()
                .ok_or("too much is closed")?
                .inside
                .push(element);
            rest = after;
        } else if let Some(tag) = rest.strip_prefix('<') {
            let (element, closed, after) = start(tag)?;
            rest = after;
            if closed || VOID.contains(&element.name.as_str()) {
                open[top].inside.push(element);
            } else {
                open.push(element);
            }
        } else {
            let end = rest.find('<').unwrap_or(rest.len());
            let words = resolved(&rest[..end])?;
            open[top].inside.push(Element {
                words,
                ..Element::default()
            });
            rest = &rest[end..];
        }
    }
    match open.pop() {
        Some(page) if open.is_empty() => Ok(page),
        other => Err(format!("{:?} is not closed", other.map(|e| e.name))),
    }
}

/// An element's start, after its `<`; whether it is closed at once; what follows.
fn start(tag: &str) -> Result<(Element, bool, &str), String> {
    let plain = |c: char| c.is_ascii_alphanumeric() || c == '-';
    let end = tag.find(|c| !plain(c)).ok_or("a tag is cut short")?;
    let mut element = Element {
        name: tag[..end].into(),
        ..Element::default()
    };
    if element.name.is_empty() {
        return Err(format!(
            "no name in {:?}",
            tag.chars().take(20).collect::<String>()
        ));
    }
    let mut rest = &tag[end..];
    loop {
        if let Some(after) = rest.strip_prefix('>') {
            return Ok((element, false, after));
        }
        if let Some(after) = rest.strip_prefix("/>") {
            return Ok((element, true, after));
        }
        rest = rest
            .strip_prefix(' ')
            .ok_or(format!("{}: odd attributes", element.name))?;
        let (key, after) = rest
            .split_once("=\"")
            .ok_or("an attribute without a value")?;
        let (value, after) = after.split_once('"').ok_or("an attribute is not closed")?;
        if !key.chars().all(plain) && key != "viewBox" || value.contains('<') {
            return Err(format!("{}: {key}={value}", element.name));
        }
        if element.attributes.iter().any(|(k, _)| k == key) {
            return Err(format!("{}: {key} twice", element.name));
        }
        element.attributes.push((key.into(), resolved(value)?));
        rest = after;
    }
}

fn resolved(text: &str) -> Result<String, String> {
    let mut out = String::new();
    let mut rest = text;
    while let Some(at) = rest.find('&') {
        out.push_str(&rest[..at]);
        let known = KNOWN.iter().find(|(name, _)| rest[at..].starts_with(name));
        let (name, c) = known.ok_or(format!("an unknown reference in {text:?}"))?;
        out.push(*c);
        rest = &rest[at + name.len()..];
    }
    Ok(out + rest)
}

#[test]
fn what_is_not_well_formed_is_seen() {
    let page = |inside: &str| parse(&format!("<!DOCTYPE html>\n<p>{inside}</p>"));
    assert_eq!(
        page("a &amp; <b class=\"c\">d</b>").unwrap().text(),
        "a & d"
    );
    for bad in [
        "<b>",
        "</b>",
        "<b>x</i>",
        "a & b",
        "<b class=c>d</b>",
        "<b a=\"1\" a=\"2\">d</b>",
    ] {
        assert!(page(bad).is_err(), "{bad}");
    }
}
