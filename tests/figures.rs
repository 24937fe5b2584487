//! The README's figures are those of the newest results: each is worked out here from the JSON that
//! the benches wrote, and must stand in the README as it is. A figure that was changed by hand, or
//! was left when newer results came, makes a test fail.
//!
//! This reads the JSON by itself; what writes the marked blocks is `benches/run --readme`.

use serde_json::Value;
use std::fs;
use std::path::{Path, PathBuf};

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

fn readme() -> String {
    fs::read_to_string(root().join("README.md")).expect("README.md")
}

fn json(path: &Path) -> Value {
    let text = fs::read(path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    serde_json::from_slice(&text).unwrap_or_else(|e| panic!("{}: {e}", path.display()))
}

/// The date and number of a folder of results; one with a word behind `cores` is a partial result.
fn age(name: &str) -> Option<(String, u32)> {
    let (machine, rest) = name.split_once("-cores")?;
    let number = match rest.strip_prefix('-') {
        Some(number) => number.parse().ok()?,
        None if rest.is_empty() => 1,
        None => return None,
    };
    Some((machine.get(..10)?.to_owned(), number))
}

/// The newest folder of results that has a file, by its name.
fn newest(file: &str) -> Option<(String, Value)> {
    let dir = root().join("benches/results");
    let names = fs::read_dir(&dir).expect("benches/results").flatten();
    let names = names.map(|entry| entry.file_name().to_string_lossy().into_owned());
    let known = names.filter(|name| dir.join(name).join(file).exists());
    let (_, name) = known.filter_map(|name| Some((age(&name)?, name))).max()?;
    let path: PathBuf = dir.join(&name).join(file);
    Some((name, json(&path)))
}

fn number(value: &Value) -> f64 {
    value
        .as_f64()
        .unwrap_or_else(|| panic!("no number: {value}"))
}

fn list(value: &Value) -> &[Value] {
    value.as_array().map_or(&[], Vec::as_slice)
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    let n = values.len();
    (values[(n - 1) / 2] + values[n / 2]) / 2.0
}

/// The cells of a table's line, the rule and the head among them.
fn cells(line: &str) -> Vec<&str> {
    line.trim()
        .trim_matches('|')
        .split('|')
        .map(str::trim)
        .collect()
}

/// The rows of the tables in a text, without heads and rules.
fn rows(text: &str) -> Vec<Vec<&str>> {
    let lines: Vec<&str> = text.lines().collect();
    let table = |i: usize| lines.get(i).is_some_and(|l| l.starts_with('|'));
    let rule = |i: usize| lines.get(i).is_some_and(|l| l.starts_with("| ---"));
    (0..lines.len())
        .filter(|&i| table(i) && !rule(i) && !rule(i + 1))
        .map(|i| cells(lines[i]))
        .collect()
}

fn between<'a>(text: &'a str, from: &str, to: &str) -> &'a str {
    let (_, rest) = text
        .split_once(from)
        .unwrap_or_else(|| panic!("README.md has no {from}"));
    rest.split_once(to)
        .unwrap_or_else(|| panic!("README.md has no {to} after {from}"))
        .0
}

/// A marked block, held to link the results that it was drawn from. Without results it has no figure.
fn block<'a>(readme: &'a str, part: &str, found: Option<&(String, Value)>) -> &'a str {
    let text = between(
        readme,
        &format!("<!-- figures: {part} -->"),
        "<!-- figures end -->",
    );
    match found {
        Some((folder, _)) => {
            let link = format!("benches/results/{folder}/{part}.md");
            assert!(
                text.contains(&link),
                "the block {part} must be of {link}: benches/run --readme"
            );
        }
        None => assert!(
            !text.contains(|c: char| c.is_ascii_digit()),
            "{part} has figures but no results"
        ),
    }
    text
}

/// Thousands apart, as the README writes counts.
fn spaced(n: u64) -> String {
    let digits = n.to_string();
    let parts: Vec<&str> = digits
        .as_bytes()
        .rchunks(3)
        .rev()
        .map(|p| std::str::from_utf8(p).unwrap_or(""))
        .collect();
    parts.join(" ")
}

/// What the README must say of a mesh at 14 bits.
fn size_row(mesh: &Value, row: &Value) -> Vec<String> {
    let triangles = number(&mesh["triangles"]);
    let bits = |bytes: &Value| format!("{:.2}", 8.0 * number(bytes) / triangles);
    let ways = &row["draco"];
    let oriented = &ways["oriented"];
    let came = if ways["came"].is_null() {
        oriented
    } else {
        &ways["came"]
    };
    let least = |way: &Value| {
        list(&way["bytes_by_level"])
            .iter()
            .map(number)
            .fold(f64::MAX, f64::min)
    };
    for way in [came, oriented] {
        assert_eq!(
            list(&way["bytes_by_level"]).len(),
            11,
            "levels of {}",
            mesh["name"]
        );
        assert_eq!(
            number(&way["bytes"]),
            least(way),
            "Draco's smallest of {}",
            mesh["name"]
        );
    }
    let best = least(came).min(least(oriented));
    let ours = |level: &str| &row["encoders"][format!("cornermill {level}, threads all")]["bytes"];
    let zstd = mesh["zstd_v_and_g"].as_object().expect("zstd").values();
    let zstd = zstd
        .map(|z| number(&z["bits_a_triangle"]))
        .fold(f64::MAX, f64::min);
    let real = if mesh["real"] == true { " (real)" } else { "" };
    let text = |value: &Value| value.as_str().expect("text").to_owned();
    vec![
        format!("{}: {}{real}", text(&mesh["name"]), text(&mesh["words"])),
        spaced(triangles as u64),
        format!("{zstd:.1}"),
        bits(&came["bytes"]),
        bits(&oriented["bytes"]),
        bits(ours("fast")),
        bits(ours("strong")),
        format!("{:.2}", number(ours("fast")) / best),
        format!("{:.2}", number(ours("strong")) / best),
    ]
}

#[test]
fn sizes_are_those_of_the_newest_results() {
    let readme = readme();
    let found = newest("draco.json");
    let shown = rows(block(&readme, "draco", found.as_ref()));
    let Some((_, found)) = found else {
        assert!(shown.is_empty(), "rows without results");
        return;
    };
    let mut expected = Vec::new();
    for mesh in list(&found["meshes"]) {
        let at_14 = list(&mesh["rows"]).iter().filter(|row| row["bits"] == 14);
        expected.extend(at_14.map(|row| size_row(mesh, row)));
    }
    assert_eq!(shown, expected);
    let real = shown
        .iter()
        .filter(|row| row[0].ends_with("(real)"))
        .count();
    assert!(
        shown.len() >= 6 && real >= 3,
        "{} meshes, {real} of them real",
        shown.len()
    );
}

/// The row of a peer on the sphere of 8M triangles, in an order.
fn on_8m<'a>(found: &'a Value, peer: &str, shuffled: bool) -> Option<&'a Value> {
    list(&found["rows"]).iter().find(|row| {
        let text = |key: &str| row[key].as_str().unwrap_or_default();
        text("mesh").starts_with("sphere")
            && !text("mesh").contains("defects")
            && (7e6..=9e6).contains(&number(&row["triangles"]))
            && text("order").starts_with("shuffle") == shuffled
            && text("peer") == peer
    })
}

/// Time, memory and right answers of a peer, as the README must say them.
fn peer_cells(found: &Value, peer: &str, shuffled: bool) -> [String; 3] {
    let Some(row) = on_8m(found, peer, shuffled) else {
        return ["not run".into(), "not run".into(), "none".into()];
    };
    let verdicts = row["right"].as_object().into_iter().flatten();
    let verdicts: Vec<&str> = verdicts
        .filter_map(|(_, v)| v["verdict"].as_str())
        .collect();
    let right = verdicts.iter().filter(|v| **v == "right").count();
    let judged = right + verdicts.iter().filter(|v| **v == "wrong").count();
    let right = if judged > 0 {
        format!("{right} of {judged}")
    } else {
        "none".into()
    };
    if row["seconds"].is_null() {
        let word = match row["outcome"].as_str().unwrap_or_default() {
            "timeout" => "timed out",
            "memory" => "out of memory",
            "crash" => "crashed",
            other => other,
        };
        return [word.into(), word.into(), right];
    }
    let ours = on_8m(found, "cornermill", shuffled).expect("Cornermill's row");
    let times = |key: &str| {
        let times = number(&row[key]["median"]) / number(&ours[key]["median"]);
        if times < 100.0 {
            format!("{times:.1}")
        } else {
            format!("{times:.0}")
        }
    };
    [times("seconds"), times("peak_mib"), right]
}

#[test]
fn peers_are_those_of_the_newest_results() {
    let readme = readme();
    let found = newest("peers.json");
    let shown = rows(block(&readme, "peers", found.as_ref()));
    let Some((_, found)) = found else {
        assert!(shown.is_empty(), "rows without results");
        return;
    };
    let mut peers: Vec<&str> = Vec::new();
    for peer in list(&found["rows"])
        .iter()
        .filter_map(|row| row["peer"].as_str())
    {
        if peer != "cornermill" && !peers.contains(&peer) {
            peers.push(peer);
        }
    }
    let row = |peer: &&str| -> Vec<String> {
        let both = [false, true].map(|shuffled| peer_cells(&found, peer, shuffled));
        std::iter::once((*peer).to_owned())
            .chain(both.into_iter().flatten())
            .collect()
    };
    assert_eq!(shown, peers.iter().map(row).collect::<Vec<_>>());
}

/// The rows of a run of the bench `build`.
struct Built(Value);

impl Built {
    fn row(&self, name: &str) -> &Value {
        let row = list(&self.0["rows"]).iter().find(|row| row["name"] == name);
        row.unwrap_or_else(|| {
            panic!("the newest build.json has no row {name}, which README.md quotes")
        })
    }

    fn rate(&self, name: &str) -> f64 {
        number(&self.row(name)["million_triangles_a_second"]["median"])
    }

    fn peak(&self, name: &str) -> f64 {
        number(&self.row(name)["peak_resident_bytes"]) / f64::from(1 << 20)
    }

    /// Budget, rate, peak and bars of a row, as the README must say them.
    fn line(&self, name: &str) -> Vec<String> {
        let row = self.row(name);
        let memory = row["memory"].as_str().expect("a budget");
        vec![
            memory.replace("MiB", " MiB").replace("GiB", " GiB"),
            format!("{:.1}", self.rate(name)),
            format!("{:.0} MiB", self.peak(name)),
            bars(list(&row["verdicts"])),
        ]
    }

    /// Seconds a triangle in those of another row.
    fn times(&self, name: &str, other: &str) -> f64 {
        self.rate(other) / self.rate(name)
    }

    fn floor(&self, name: &str, threads: &str) -> f64 {
        number(&self.row(name)[format!("ratio_to_floor_{threads}")]["median"])
    }

    /// Seconds of NumPy and SciPy in those of the build, and their peak in MiB.
    fn in_memory(&self, name: &str) -> (f64, f64) {
        let rounds = list(&self.row(name)["rounds"]);
        let times = |r: &Value| number(&r["in_memory"]["seconds"]) / number(&r["build"]["seconds"]);
        let peak = |r: &Value| number(&r["in_memory"]["peak"]["kernel"]) / f64::from(1 << 20);
        let peak = rounds.iter().map(peak).fold(0.0, f64::max);
        (median(rounds.iter().map(times).collect()), peak)
    }
}

/// What the bench said of a row's bars, in the README's words.
fn bars(verdicts: &[Value]) -> String {
    let said = || verdicts.iter().filter_map(|v| v.as_str()?.split_once(": "));
    let of = |unit: &str| said().find_map(|(bar, word)| Some((bar.strip_suffix(unit)?, word)));
    match (of(" Mtri/s"), of(" MiB")) {
        (Some((rate, fast)), Some((peak, small))) if fast == small => {
            format!("{rate} and {peak} MiB: {fast}")
        }
        (Some((rate, fast)), Some((peak, small))) => {
            format!("{rate}: {fast}, {peak} MiB: {small}")
        }
        _ => {
            let all = said().map(|(bar, word)| format!("{bar}: {word}"));
            let all = all.collect::<Vec<_>>().join("; ");
            all.replace(" x c8 a triangle", " times the time of 8M a triangle")
        }
    }
}

/// Words, so that lines may break anywhere.
fn words(text: &str) -> String {
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}

#[test]
fn speed_is_that_of_the_newest_results() {
    let readme = readme();
    let speed = between(&readme, "\n## Speed\n", "\n## ");
    let (folder, found) = newest("build.json").expect("results of the bench build");
    let link = format!("(benches/results/{folder}/build.md)");
    assert!(speed.contains(&link), "## Speed must quote {link}");
    let found = Built(found);
    let (own, rest) = speed
        .split_once("Measures of vertices, by turns")
        .expect("the measures' paragraph");
    let names = [
        "c32", "rv32", "s32", "s32-96", "c32-stl", "s32-stl", "c256", "s256", "c1000-v",
    ];
    let shown: Vec<Vec<&str>> = rows(own).iter().map(|row| row[1..].to_vec()).collect();
    assert_eq!(shown, names.map(|name| found.line(name)));

    let (coherent, peak) = found.in_memory("c8");
    let (shuffled, _) = found.in_memory("s8");
    let claims = [
        format!("(is {:.2})", found.times("c256", "c8")),
        format!(
            "takes {:.2} times the floor",
            found.floor("c32", "one_thread")
        ),
        format!(
            "and {:.1} times the floor on two",
            found.floor("c32", "all_threads")
        ),
        format!("take {coherent:.0} times the time of `build`"),
        format!("and {shuffled:.0} times for the shuffled one"),
        format!(
            "with {peak:.0} MiB against {:.0} and {:.0}",
            found.peak("c8"),
            found.peak("s8")
        ),
    ];
    for claim in claims {
        assert!(
            words(own).contains(&claim),
            "## Speed does not say: {claim}"
        );
    }
    for (name, after) in [
        ("fan10", "(fan, cone)"),
        ("cone10", "(fan, cone)"),
        ("book10", "(one edge)"),
        ("stack10", "times (all the same)"),
    ] {
        let claim = format!("{:.1} {after}", found.times(name, "s10"));
        assert!(
            words(rest).contains(&claim),
            "## Speed does not say: {claim}"
        );
    }
}

#[test]
fn the_cost_of_measures_is_that_of_the_results_it_links() {
    let readme = readme();
    let speed = between(&readme, "\n## Speed\n", "\n## ");
    let (_, text) = speed
        .split_once("Measures of vertices, by turns")
        .expect("the measures' paragraph");
    let page = between(text, "(benches/results/", "build.md)");
    let found = Built(json(
        &root().join("benches/results").join(page).join("build.json"),
    ));
    let row = |name: &str| {
        let bare = format!("{name}-bare");
        let left = 100.0 * found.rate(name) / found.rate(&bare);
        let peaks = [found.peak(&bare), found.peak(name)].map(|peak| format!("{peak:.0}"));
        let peaks = if peaks[0] == peaks[1] {
            format!("{} MiB both", peaks[0])
        } else {
            format!("{} MiB", peaks.join(", "))
        };
        [
            format!("{:.1}", found.rate(&bare)),
            format!("{:.1}", found.rate(name)),
            format!("{left:.0} %"),
            peaks,
        ]
    };
    let shown: Vec<[&str; 4]> = rows(text)
        .iter()
        .map(|r| [r[2], r[3], r[4].split(':').next().unwrap_or(""), r[5]])
        .collect();
    assert_eq!(shown, ["c32", "s32"].map(row));
}

#[test]
fn numbers_and_ages_are_told_apart() {
    assert_eq!(spaced(1_002_528), "1 002 528");
    assert_eq!(spaced(536), "536");
    assert!(age("2026-11-24-amd-epyc-2-cores") < age("2026-11-24-amd-epyc-2-cores-10"));
    assert!(age("2026-11-24-amd-epyc-2-cores-10") < age("2026-11-25-other-4-cores"));
    assert_eq!(age("2026-11-24-amd-epyc-2-cores-measures"), None);
}
