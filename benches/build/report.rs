//! What the bench found, as a Markdown page and as JSON, and the file where it is kept.

use crate::cases::{self, Case};
use crate::machine::{Figures, commit, date};
use crate::process::Peak;
use crate::row::{Row, Spread};
use crate::{Result, at};
use serde_json::{Value, json};
use std::fmt::Write;
use std::fs;
use std::path::{Path, PathBuf};

/// Everything that was found on one day on one machine at one commit.
pub struct Report {
    figures: Figures,
    date: String,
    commit: String,
    cases: Vec<Case>,
    judged: bool,
    rows: Vec<Row>,
    folder: PathBuf,
    /// What its files are called.
    stem: &'static str,
}

impl Report {
    /// A report without rows; bars are for rows of the size that they name, which `judged` says.
    pub fn new(figures: Figures, judged: bool, stem: &'static str) -> Result<Report> {
        Ok(Report {
            stem,
            figures,
            date: date()?,
            commit: commit().unwrap_or("unknown".into()),
            cases: cases::all(),
            judged,
            rows: Vec::new(),
            folder: PathBuf::new(),
        })
    }

    /// Settles on a folder, and takes over the rows that an earlier run of this commit saved there:
    /// `out`, which must not hold another commit's, or the first of this day and machine that does not.
    pub fn resume(&mut self, out: Option<&Path>) -> Result<()> {
        let dir = Path::new(env!("CARGO_MANIFEST_DIR")).join("benches/results");
        let base = format!("{}-{}", self.date, self.figures.slug());
        for number in 1.. {
            let next = match number {
                1 => dir.join(&base),
                _ => dir.join(format!("{base}-{number}")),
            };
            self.folder = out.map_or(next, Path::to_owned);
            let path = self.folder.join(format!("{}.json", self.stem));
            let Ok(text) = fs::read(&path) else {
                break;
            };
            let mut saved: Value = serde_json::from_slice(&text).map_err(at_json(&path))?;
            let commit = saved["commit"].as_str().unwrap_or("unknown");
            if bare(commit) == bare(&self.commit) {
                let rows = saved["rows"].take();
                self.rows = serde_json::from_value(rows).map_err(at_json(&path))?;
                break;
            }
            if out.is_some() {
                let path = path.display();
                return Err(format!("{path}: holds commit {commit}; give another --out").into());
            }
        }
        Ok(())
    }

    /// Whether there is a row of this name on the same mesh.
    pub fn has(&self, case: &Case) -> bool {
        let same = |row: &Row| row.name == case.name && row.mesh == case.words();
        self.rows.iter().any(same)
    }

    /// Adds a row, or puts it in the place of the one that has its name.
    pub fn add(&mut self, row: Row) {
        self.rows.retain(|other| other.name != row.name);
        self.rows.push(row);
        let place = |row: &Row| self.cases.iter().position(|case| case.name == row.name);
        self.rows.sort_by_key(place);
    }

    /// The report as a page.
    pub fn markdown(&self) -> String {
        let f = &self.figures;
        let mut text = format!(
            "# `build`, row by row: {}, {} cores\n\n\
             {}, commit {}. Meshes of data-gen in the page cache; floor (reading the same input and writing \
             the same output) and build by turns; median (least to most). Seconds are without the final \
             sync; peaks are the highest of all rounds, file-backed pages included; bytes are those of \
             the middle round, scratch included.\n\n",
            f.cpu, f.cores, self.date, self.commit,
        );
        head(
            &mut text,
            &[
                "row",
                "mesh",
                "`--memory`",
                "Mtri/s",
                "x floor, 1 thread",
                "x floor, all threads",
                "peak resident MiB",
                "scratch MiB",
                "read MiB",
                "written MiB",
                "seconds",
                "sync s",
                "bars",
            ],
        );
        self.rows.iter().for_each(|row| self.line(row, &mut text));
        self.beside_scipy(&mut text);
        self.rows.iter().for_each(|row| self.passes(row, &mut text));
        text.push_str("\n## The machine\n\n");
        head(&mut text, &["figure", "GB/s"]);
        for (name, rate) in self.rates() {
            let rate = rate.map_or("unknown".into(), |r| format!("{:.2}", r / 1e9));
            line(&mut text, &[name, rate]);
        }
        text
    }

    fn case(&self, row: &Row) -> Option<&Case> {
        self.cases.iter().find(|case| case.name == row.name)
    }

    fn verdicts(&self, row: &Row) -> Vec<String> {
        let case = self.case(row).filter(|_| self.judged);
        case.map_or(Vec::new(), |case| row.verdicts(&case.bars, &self.rows))
    }

    fn line(&self, row: &Row, to: &mut String) {
        let verdicts = self.verdicts(row).join("; ");
        let (name, mesh, memory) = (row.name.clone(), row.mesh.clone(), row.memory.clone());
        let Some(middle) = row.middle() else {
            let said = row.refused.as_deref().unwrap_or("no round");
            let mut cells = vec![name, mesh, memory, said.replace('|', "/")];
            cells.resize(12, String::new());
            cells.push(verdicts);
            return line(to, &cells);
        };
        let peak = match row.peak() {
            Peak::Kernel(bytes) => mib(bytes),
            Peak::Own(bytes) => format!("{} (its own word)", mib(bytes)),
            Peak::Unknown => "unknown".into(),
        };
        let text = |spread: Option<Spread>, digits| {
            spread.map_or("unknown".into(), |spread| spread.text(digits))
        };
        let [one, all] = row.ratios();
        let passes = &middle.build.passes;
        let cells = [
            name,
            mesh,
            memory,
            text(row.rate(), 1),
            text(one, 2),
            text(all, 2),
            peak,
            mib(middle.build.scratch),
            mib(passes.iter().map(|p| p.read).sum()),
            mib(passes.iter().map(|p| p.written).sum()),
            text(row.spread(|r| r.build.seconds), 2),
            text(row.sync(), 2),
            verdicts,
        ];
        line(to, &cells);
    }

    /// The rows on which NumPy and SciPy took turns with the build.
    fn beside_scipy(&self, to: &mut String) {
        let all = |row: &Row| row.rounds.iter().all(|r| r.in_memory.is_some());
        let rows: Vec<&Row> = self.rows.iter().filter(|row| all(row)).collect();
        let mut table = String::new();
        for row in rows {
            let figures = || {
                row.rounds
                    .iter()
                    .filter_map(|r| Some((r, r.in_memory.as_ref()?)))
            };
            let spread = |of: fn(f64, f64) -> f64| {
                Spread::of(
                    figures()
                        .map(|(r, m)| of(m.seconds, r.build.seconds))
                        .collect(),
                )
            };
            let loading = Spread::of(figures().map(|(_, m)| m.loading).collect());
            let peak = figures().map(|(_, m)| m.peak).max().and_then(Peak::bytes);
            let (Some(seconds), Some(times), Some(loading)) = (
                spread(|own, _| own),
                spread(|own, build| own / build),
                loading,
            ) else {
                continue;
            };
            let cells = [
                row.name.clone(),
                row.mesh.clone(),
                format!("{:.2}", row.triangles as f64 / 1e6 / seconds.median()),
                seconds.text(2),
                loading.text(2),
                peak.map_or("unknown".into(), mib),
                times.text(1),
                row.peak().bytes().map_or("unknown".into(), mib),
            ];
            line(&mut table, &cells);
        }
        if table.is_empty() {
            return;
        }
        to.push_str(
            "\n## NumPy and SciPy in memory on the same mesh\n\n\
             `in_memory.py` by turns with the build; it sorts edges and searches the graph, and writes nothing. \
             Its seconds are without loading.\n\n",
        );
        head(
            to,
            &[
                "row",
                "mesh",
                "its Mtri/s",
                "its seconds",
                "its loading s",
                "its peak MiB",
                "its seconds in those of the build",
                "peak MiB of the build",
            ],
        );
        to.push_str(&table);
    }

    /// The passes of a row that is held to a rate.
    fn passes(&self, row: &Row, to: &mut String) {
        let bars = self.case(row).is_some_and(|case| case.bars.rate.is_some());
        let Some(middle) = row.middle().filter(|r| bars && !r.build.passes.is_empty()) else {
            return;
        };
        let (input, output) = (mib(row.input), mib(row.output));
        let _ = write!(
            to,
            "\n## {}: the passes of the middle round\n\nInput {input}, output {output} MiB; the floor took {:.2} s \
             on one thread, {:.2} s on all, and {:.2} s to sync.\n\n",
            row.name,
            middle.floor_one_thread.seconds,
            middle.floor_all_threads.seconds,
            middle.floor_one_thread.sync,
        );
        head(to, &["pass", "seconds", "read, MiB", "written, MiB"]);
        for p in &middle.build.passes {
            let seconds = format!("{:.3}", p.seconds);
            line(to, &[p.name.clone(), seconds, mib(p.read), mib(p.written)]);
        }
    }

    fn rates(&self) -> [(String, Option<f64>); 6] {
        let f = &self.figures;
        [
            ("memory copy, 1 thread".into(), Some(f.copy_one)),
            ("memory copy, all threads".into(), Some(f.copy_all)),
            ("sequential write, page cache".into(), Some(f.write_cache)),
            ("sequential write, synced".into(), Some(f.write_disk)),
            ("sequential read, page cache".into(), Some(f.read_cache)),
            ("sequential read, direct".into(), f.read_disk),
        ]
    }

    fn json(&self) -> Value {
        let f = &self.figures;
        let rows = self.rows.iter().map(|row| row.json(&self.verdicts(row)));
        json!({
            "bench": "build",
            "date": self.date,
            "commit": self.commit,
            "cpu": f.cpu,
            "cores": f.cores,
            "bytes_a_second": {
                "copy_one_thread": f.copy_one,
                "copy_all_threads": f.copy_all,
                "write_page_cache": f.write_cache,
                "write_synced": f.write_disk,
                "read_page_cache": f.read_cache,
                "read_direct": f.read_disk,
            },
            "rows": rows.collect::<Vec<_>>(),
        })
    }

    /// Writes both forms to the folder that was settled on.
    pub fn save(&self) -> Result<()> {
        let json = format!("{:#}\n", self.json());
        for (end, text) in [("md", self.markdown()), ("json", json)] {
            let path = self.folder.join(format!("{}.{end}", self.stem));
            fs::create_dir_all(&self.folder).map_err(at(&self.folder))?;
            fs::write(&path, text).map_err(at(&path))?;
        }
        Ok(())
    }
}

/// A commit without `-dirty`: saved results themselves make the tree differ.
fn bare(commit: &str) -> &str {
    commit.trim_end_matches("-dirty")
}

fn at_json(path: &Path) -> impl Fn(serde_json::Error) -> String + '_ {
    move |e| format!("{}: {e}", path.display())
}

fn mib(bytes: u64) -> String {
    format!("{:.0}", bytes as f64 / f64::from(1 << 20))
}

/// The first row of a table; columns of figures are flush right.
fn head(to: &mut String, names: &[&str]) {
    line(to, names);
    let rule = |name: &&str| match *name {
        "row" | "mesh" | "bars" | "pass" | "figure" => "---",
        _ => "---:",
    };
    let rules: Vec<_> = names.iter().map(rule).collect();
    line(to, &rules);
}

fn line(to: &mut String, cells: &[impl AsRef<str>]) {
    let cells: Vec<_> = cells.iter().map(AsRef::as_ref).collect();
    let _ = writeln!(to, "| {} |", cells.join(" | "));
}
