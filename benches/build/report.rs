//! What the bench found, as a Markdown table and as JSON.

use crate::floor::Floor;
use crate::machine::{Figures, commit, date};
use crate::process::{Built, Peak};
use crate::{Result, at};
use serde_json::{Value, json};
use std::fmt::Write;
use std::fs;
use std::path::Path;

/// Floor and build, one after the other.
pub struct Round {
    /// The floor on one thread.
    pub one: Floor,
    /// The floor on as many threads as the build.
    pub all: Floor,
    /// The build.
    pub built: Built,
}

/// All rounds on one mesh.
pub struct Case {
    /// The size that was asked for.
    pub size: String,
    /// Triangles of the mesh.
    pub triangles: u64,
    /// Bytes of V and G.
    pub input: u64,
    /// Bytes of the finished folder.
    pub output: u64,
    /// The rounds, in order.
    pub rounds: Vec<Round>,
}

/// Median, least and most.
#[derive(Clone, Copy)]
struct Spread([f64; 3]);

impl Spread {
    fn of(mut values: Vec<f64>) -> Spread {
        values.sort_by(f64::total_cmp);
        let n = values.len();
        let median = (values[(n - 1) / 2] + values[n / 2]) / 2.0;
        Spread([median, values[0], values[n - 1]])
    }

    fn text(self, digits: usize) -> String {
        let [median, min, max] = self.0;
        format!("{median:.digits$} ({min:.digits$} to {max:.digits$})")
    }

    fn json(self) -> Value {
        let [median, min, max] = self.0;
        json!({ "median": median, "min": min, "max": max })
    }
}

impl Case {
    fn spread(&self, of: impl Fn(&Round) -> f64) -> Spread {
        Spread::of(self.rounds.iter().map(of).collect())
    }

    /// Million triangles a second, the final sync apart.
    fn rate(&self) -> Spread {
        self.spread(|r| self.triangles as f64 / 1e6 / r.built.seconds)
    }

    /// Seconds of the build in those of the floor of its round, on one thread and on all.
    fn ratios(&self) -> [Spread; 2] {
        [
            self.spread(|r| r.built.seconds / r.one.seconds),
            self.spread(|r| r.built.seconds / r.all.seconds),
        ]
    }

    /// The highest peak of all rounds.
    fn peak(&self) -> Peak {
        let bytes = |peak| match peak {
            Peak::Kernel(bytes) | Peak::Own(bytes) => bytes,
            Peak::Unknown => 0,
        };
        let peaks = self.rounds.iter().map(|r| r.built.peak);
        peaks.max_by_key(|&p| bytes(p)).unwrap_or(Peak::Unknown)
    }

    fn sync(&self) -> Option<Spread> {
        let known: Option<Vec<f64>> = self.rounds.iter().map(|r| r.built.sync).collect();
        known.map(Spread::of)
    }

    /// The round in which the build took the median time, or the next longer one.
    fn middle(&self) -> &Round {
        let mut rounds: Vec<_> = self.rounds.iter().collect();
        rounds.sort_by(|a, b| a.built.seconds.total_cmp(&b.built.seconds));
        rounds[rounds.len() / 2]
    }

    fn row(&self, to: &mut String) {
        let peak = match self.peak() {
            Peak::Kernel(bytes) => mib(bytes),
            Peak::Own(bytes) => format!("{} (its own word)", mib(bytes)),
            Peak::Unknown => "unknown".into(),
        };
        let [one, all] = self.ratios();
        let cells = [
            self.triangles.to_string(),
            self.rate().text(1),
            self.spread(|r| r.built.seconds).text(2),
            one.text(2),
            all.text(2),
            peak,
            self.sync()
                .map_or("not told apart".into(), |sync| sync.text(2)),
            self.spread(|r| r.one.seconds).text(2),
            self.spread(|r| r.all.seconds).text(2),
            self.spread(|r| r.one.sync).text(2),
        ];
        line(to, &cells);
    }

    fn passes(&self, to: &mut String) {
        let built = &self.middle().built;
        if built.passes.is_empty() {
            return;
        }
        let _ = write!(to, "\n## {}: the passes of the middle round\n\n", self.size);
        let _ = writeln!(
            to,
            "Input {}, output {} MiB.\n",
            mib(self.input),
            mib(self.output)
        );
        head(to, &["pass", "seconds", "read, MiB", "written, MiB"]);
        for p in &built.passes {
            let seconds = format!("{:.3}", p.seconds);
            line(to, &[p.name.clone(), seconds, mib(p.read), mib(p.written)]);
        }
    }

    fn json(&self) -> Value {
        let [one, all] = self.ratios();
        let (peak, source) = match self.peak() {
            Peak::Kernel(bytes) => (Some(bytes), "kernel"),
            Peak::Own(bytes) => (Some(bytes), "report"),
            Peak::Unknown => (None, "unknown"),
        };
        let rounds = self.rounds.iter().map(|r| {
            let passes = r.built.passes.iter().map(|p| {
                json!({ "name": p.name, "seconds": p.seconds, "read": p.read, "written": p.written })
            });
            json!({
                "floor_one_thread": { "seconds": r.one.seconds, "sync": r.one.sync },
                "floor_all_threads": { "seconds": r.all.seconds, "sync": r.all.sync },
                "build": {
                    "seconds": r.built.seconds,
                    "sync": r.built.sync,
                    "passes": passes.collect::<Vec<_>>(),
                },
            })
        });
        json!({
            "size": self.size,
            "triangles": self.triangles,
            "input_bytes": self.input,
            "output_bytes": self.output,
            "million_triangles_a_second": self.rate().json(),
            "ratio_to_floor_one_thread": one.json(),
            "ratio_to_floor_all_threads": all.json(),
            "peak_resident_bytes": peak,
            "peak_resident_source": source,
            "rounds": rounds.collect::<Vec<_>>(),
        })
    }
}

/// Everything that one run of the bench found.
pub struct Report {
    figures: Figures,
    memory: String,
    threads: usize,
    /// One for each size.
    pub cases: Vec<Case>,
}

impl Report {
    /// A report without cases.
    pub fn new(figures: Figures, memory: &str, threads: usize) -> Report {
        Report {
            figures,
            memory: memory.to_owned(),
            threads,
            cases: Vec::new(),
        }
    }

    /// The report as a page.
    pub fn markdown(&self) -> String {
        let (f, n) = (&self.figures, self.threads);
        let mut text = format!(
            "# `build` on coherent triangles: {}, {} cores\n\n\
             Commit {}. `cornermill build` of a displaced sphere, V and G as .npy in the page cache, \
             with `--memory {} --threads {n}`; rounds of floor and build by turns: {}; median (least to most). \
             Seconds are without the final sync.\n\n",
            f.cpu,
            f.cores,
            commit().unwrap_or("unknown".into()),
            self.memory,
            self.cases.first().map_or(0, |c| c.rounds.len()),
        );
        let (all, floor) = (
            format!("x floor, {n} threads"),
            format!("floor s, {n} threads"),
        );
        head(
            &mut text,
            &[
                "triangles",
                "Mtri/s",
                "seconds",
                "x floor, 1 thread",
                &all,
                "peak resident MiB",
                "sync s",
                "floor s, 1 thread",
                &floor,
                "floor's sync s",
            ],
        );
        self.cases.iter().for_each(|c| c.row(&mut text));
        self.cases.iter().for_each(|c| c.passes(&mut text));
        text.push_str("\n## The machine\n\n");
        head(&mut text, &["figure", "GB/s"]);
        for (name, rate) in self.rates() {
            let rate = rate.map_or("unknown".into(), |r| format!("{:.2}", r / 1e9));
            line(&mut text, &[name, rate]);
        }
        text
    }

    fn rates(&self) -> [(String, Option<f64>); 6] {
        let f = &self.figures;
        [
            ("memory copy, 1 thread".into(), Some(f.copy_one)),
            (
                format!("memory copy, {} threads", self.threads),
                Some(f.copy_all),
            ),
            ("sequential write, page cache".into(), Some(f.write_cache)),
            ("sequential write, synced".into(), Some(f.write_disk)),
            ("sequential read, page cache".into(), Some(f.read_cache)),
            ("sequential read, direct".into(), f.read_disk),
        ]
    }

    fn json(&self, date: &str) -> Value {
        let f = &self.figures;
        json!({
            "bench": "build",
            "date": date,
            "commit": commit(),
            "cpu": f.cpu,
            "cores": f.cores,
            "memory": self.memory,
            "threads": self.threads,
            "bytes_a_second": {
                "copy_one_thread": f.copy_one,
                "copy_all_threads": f.copy_all,
                "write_page_cache": f.write_cache,
                "write_synced": f.write_disk,
                "read_page_cache": f.read_cache,
                "read_direct": f.read_disk,
            },
            "cases": self.cases.iter().map(Case::json).collect::<Vec<_>>(),
        })
    }

    /// Writes both forms to the results of this day and machine.
    pub fn save(&self) -> Result<()> {
        let date = date()?;
        let dir = Path::new(env!("CARGO_MANIFEST_DIR")).join("benches/results");
        let dir = dir.join(format!("{date}-{}", self.figures.slug()));
        fs::create_dir_all(&dir).map_err(at(&dir))?;
        let json = format!("{:#}\n", self.json(&date));
        for (name, text) in [("build.md", self.markdown()), ("build.json", json)] {
            let path = dir.join(name);
            fs::write(&path, text).map_err(at(&path))?;
            eprintln!("wrote {}", path.display());
        }
        Ok(())
    }
}

fn mib(bytes: u64) -> String {
    format!("{:.0}", bytes as f64 / f64::from(1 << 20))
}

/// The first row of a table; columns of figures are flush right.
fn head(to: &mut String, names: &[&str]) {
    line(to, names);
    let rule = |i| if i == 0 { "---" } else { "---:" };
    let rules: Vec<_> = (0..names.len()).map(rule).collect();
    line(to, &rules);
}

fn line(to: &mut String, cells: &[impl AsRef<str>]) {
    let cells: Vec<_> = cells.iter().map(AsRef::as_ref).collect();
    let _ = writeln!(to, "| {} |", cells.join(" | "));
}
