//! The page in a headless Chromium, where the machine has one (else this test passes without it):
//! nothing is fetched, nothing is complained of, nothing is wider than a phone, and all text stands
//! out from what is behind it, by day and by night.
//!
//! Chromium is spoken to by its debugging protocol (JSON, each message ending in a zero byte) over
//! two named pipes, so nothing but a shell and `mkfifo` is needed. With `CORNERMILL_SCREENS=DIR`
//! the pictures of what it shows are kept there.

use super::{flawed, made};
use serde_json::{Value, json};
use std::fs::File;
use std::io::{BufRead, BufReader, Write};
use std::path::Path;
use std::process::{Child, Command, Stdio};

/// A Chromium under the names that systems give it.
fn chromium() -> Option<&'static str> {
    let names = [
        "chromium",
        "chromium-browser",
        "google-chrome",
        "google-chrome-stable",
    ];
    names.into_iter().find(|name| {
        let mut command = Command::new(name);
        command
            .arg("--version")
            .stdout(Stdio::null())
            .stderr(Stdio::null());
        command.status().is_ok_and(|status| status.success())
    })
}

struct Browser {
    child: Child,
    to: File,
    from: BufReader<File>,
    session: Option<String>,
    last: u64,
    /// What was reported besides answers: method and parameters.
    events: Vec<(String, Value)>,
}

impl Browser {
    fn start(name: &str, dir: &Path) -> Browser {
        let pipes = ["in", "out"].map(|pipe| dir.join(pipe));
        for pipe in &pipes {
            assert!(Command::new("mkfifo").arg(pipe).status().unwrap().success());
        }
        // The tests may run as root, where the browser's own sandbox does not start; the page is ours.
        let script = "exec \"$0\" --headless --no-sandbox --disable-gpu --hide-scrollbars \
                      --no-first-run --disable-background-networking --disable-dev-shm-usage \
                      --user-data-dir=\"$1\" --remote-debugging-pipe about:blank 3<\"$2\" 4>\"$3\"";
        let child = Command::new("sh")
            .args(["-c", script, name])
            .args([&dir.join("profile"), &pipes[0], &pipes[1]])
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        // In the order in which the shell opens them, or both would wait for ever.
        let to = File::options().write(true).open(&pipes[0]).unwrap();
        let from = BufReader::new(File::open(&pipes[1]).unwrap());
        Browser {
            child,
            to,
            from,
            session: None,
            last: 0,
            events: Vec::new(),
        }
    }

    /// Reads a message: the answer to call `id`, or an event, which is kept.
    fn message(&mut self) -> Value {
        let mut bytes = Vec::new();
        self.from.read_until(0, &mut bytes).unwrap();
        assert_eq!(bytes.pop(), Some(0), "the browser went away");
        let message: Value = serde_json::from_slice(&bytes).unwrap();
        if let Some(method) = message["method"].as_str() {
            self.events
                .push((method.to_owned(), message["params"].clone()));
        }
        message
    }

    fn call(&mut self, method: &str, params: Value) -> Value {
        self.last += 1;
        let mut call = json!({"id": self.last, "method": method, "params": params});
        if let Some(session) = &self.session {
            call["sessionId"] = json!(session);
        }
        self.to.write_all(format!("{call}\0").as_bytes()).unwrap();
        loop {
            let message = self.message();
            if message["id"] == json!(self.last) {
                assert!(message["error"].is_null(), "{method}: {message}");
                return message["result"].clone();
            }
        }
    }

    fn wait(&mut self, method: &str) {
        while !self.events.iter().any(|(m, _)| m == method) {
            self.message();
        }
    }

    fn evaluate(&mut self, expression: &str) -> Value {
        let params = json!({"expression": expression, "returnByValue": true});
        let result = self.call("Runtime.evaluate", params);
        assert!(result["exceptionDetails"].is_null(), "{result}");
        result["result"]["value"].clone()
    }

    fn show(&mut self, width: u32, scheme: &str) {
        let params = json!({"width": width, "height": 900, "deviceScaleFactor": 1,
            "mobile": width < 600});
        self.call("Emulation.setDeviceMetricsOverride", params);
        let feature = json!({"name": "prefers-color-scheme", "value": scheme});
        self.call("Emulation.setEmulatedMedia", json!({"features": [feature]}));
    }

    fn keep(&mut self, name: &str) {
        let Some(dir) = std::env::var_os("CORNERMILL_SCREENS") else {
            return;
        };
        let params = json!({"format": "png", "captureBeyondViewport": true});
        let shot = self.call("Page.captureScreenshot", params);
        let path = Path::new(&dir).join(format!("{name}.png.base64"));
        std::fs::write(path, shot["data"].as_str().unwrap()).unwrap();
    }
}

impl Drop for Browser {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// Texts whose contrast with what is behind them is below 4.5, as WCAG reckons it.
const FAINT: &str = r#"(() => {
  const rgb = text => text.match(/[\d.]+/g).map(Number);
  const light = c => c.slice(0, 3).map(x => x / 255)
    .map(x => x <= 0.04045 ? x / 12.92 : ((x + 0.055) / 1.055) ** 2.4)
    .reduce((sum, x, i) => sum + x * [0.2126, 0.7152, 0.0722][i], 0);
  const behind = e => {
    for (; e; e = e.parentElement) {
      const c = rgb(getComputedStyle(e).backgroundColor);
      if (c.length < 4 || c[3] > 0) return c;
    }
    return [255, 255, 255];
  };
  const faint = [];
  let looked = 0;
  for (const e of document.body.querySelectorAll('*')) {
    const own = [...e.childNodes].some(n => n.nodeType === 3 && n.textContent.trim());
    if (!own || ['STYLE', 'TITLE', 'DESC', 'title', 'desc'].includes(e.tagName)) continue;
    const style = getComputedStyle(e);
    const ink = rgb(e instanceof SVGElement ? style.fill : style.color);
    const [a, b] = [light(ink), light(behind(e))].sort((x, y) => y - x);
    looked += 1;
    if ((a + 0.05) / (b + 0.05) < 4.5) faint.push(e.tagName + ': ' + e.textContent.slice(0, 40));
  }
  return looked > 50 ? faint : ['only ' + looked + ' texts were found'];
})()"#;

#[test]
fn a_browser_shows_it_whole_by_day_and_by_night_and_on_a_phone() {
    let Some(name) = chromium() else {
        eprintln!("no Chromium here: the page was not looked at");
        return;
    };
    let made = made(&flawed(), "flawed.ct", true, &[]);
    let mut browser = Browser::start(name, made.dir.path());
    let target = browser.call("Target.createTarget", json!({"url": "about:blank"}));
    let params = json!({"targetId": target["targetId"], "flatten": true});
    let attached = browser.call("Target.attachToTarget", params);
    browser.session = attached["sessionId"].as_str().map(str::to_owned);
    for domain in ["Page", "Network", "Log", "Runtime"] {
        browser.call(&format!("{domain}.enable"), json!({}));
    }
    let url = format!("file://{}", made.page.display());
    browser.events.clear();
    browser.call("Page.navigate", json!({"url": url}));
    browser.wait("Page.loadEventFired");
    let shown = "[...document.images].every(i => i.complete && i.naturalWidth === 240)";
    assert_eq!(browser.evaluate(shown), json!(true));
    for (width, scheme) in [
        (1200, "light"),
        (1200, "dark"),
        (390, "light"),
        (390, "dark"),
        (320, "light"),
    ] {
        browser.show(width, scheme);
        browser.evaluate("document.querySelectorAll('details').forEach(d => d.open = true)");
        let wide = browser.evaluate("document.documentElement.scrollWidth");
        assert!(
            wide.as_u64().unwrap() <= u64::from(width),
            "{wide} at {width}"
        );
        assert_eq!(browser.evaluate(FAINT), json!([]), "{width} {scheme}");
        browser.evaluate("document.querySelectorAll('details').forEach(d => d.open = false)");
        browser.keep(&format!("{width}-{scheme}"));
    }
    // By keyboard: the first key leads past the head, and every wide table can be reached.
    let reached = "[...document.querySelectorAll('.wide')].every(e => e.tabIndex === 0)";
    assert_eq!(browser.evaluate(reached), json!(true));
    for (key, code) in [("Tab", 9), ("Enter", 13)] {
        for kind in ["rawKeyDown", "keyUp"] {
            let text = if key == "Enter" && kind == "rawKeyDown" {
                "\r"
            } else {
                ""
            };
            let kind = if text.is_empty() { kind } else { "keyDown" };
            let params = json!({"type": kind, "key": key, "code": key, "text": text,
                "windowsVirtualKeyCode": code});
            browser.call("Input.dispatchKeyEvent", params);
        }
        if key == "Tab" {
            assert_eq!(
                browser.evaluate("document.activeElement.className"),
                json!("skip")
            );
        }
    }
    assert_eq!(browser.evaluate("location.hash"), json!("#verdicts"));
    for (method, params) in &browser.events {
        match method.as_str() {
            "Network.requestWillBeSent" => {
                let to = params["request"]["url"].as_str().unwrap();
                let page = to.split('#').next() == Some(&url);
                assert!(page || to.starts_with("data:"), "asked for {to}");
            }
            "Log.entryAdded" | "Runtime.consoleAPICalled" | "Runtime.exceptionThrown" => {
                panic!("{method}: {params}")
            }
            _ => {}
        }
    }
}
