//! What one row found: rounds of floor and build, and whether each bar was met.

use crate::cases::Bars;
use crate::floor::Floor;
use crate::process::{Built, Peak};
use crate::scipy::InMemory;
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};

/// Floor and build, one after the other, and what else took its turn.
#[derive(Clone, Debug, Deserialize, Serialize)]
pub struct Round {
    /// The floor on one thread.
    pub floor_one_thread: Floor,
    /// The floor on as many threads as the build.
    pub floor_all_threads: Floor,
    /// The build.
    pub build: Built,
    /// NumPy and SciPy, where the row has them.
    pub in_memory: Option<InMemory>,
}

/// All rounds of a row.
#[derive(Clone, Debug, Deserialize, Serialize)]
pub struct Row {
    /// The row's name.
    pub name: String,
    /// The mesh, in words.
    pub mesh: String,
    /// Triangles of the mesh.
    pub triangles: u64,
    /// What `--memory` was given.
    pub memory: String,
    /// What `--threads` was given.
    pub threads: usize,
    /// Without measures.
    #[serde(default)]
    pub bare: bool,
    /// Bytes of the input.
    pub input: u64,
    /// Bytes of the finished folder.
    pub output: u64,
    /// Why there is no round: the budget was too small, in the program's words.
    pub refused: Option<String>,
    /// The rounds, in order.
    pub rounds: Vec<Round>,
}

/// Median, least and most.
#[derive(Clone, Copy)]
pub struct Spread([f64; 3]);

impl Spread {
    /// Of some values; none of no values.
    pub fn of(mut values: Vec<f64>) -> Option<Spread> {
        values.sort_by(f64::total_cmp);
        let n = values.len();
        let (first, last) = (*values.first()?, *values.last()?);
        let median = (values[(n - 1) / 2] + values[n / 2]) / 2.0;
        Some(Spread([median, first, last]))
    }

    /// The median.
    pub fn median(self) -> f64 {
        self.0[0]
    }

    /// `median (least to most)`, or the only value.
    pub fn text(self, digits: usize) -> String {
        let [median, min, max] = self.0;
        if min == max {
            return format!("{median:.digits$}");
        }
        format!("{median:.digits$} ({min:.digits$} to {max:.digits$})")
    }

    fn json(self) -> Value {
        let [median, min, max] = self.0;
        json!({ "median": median, "min": min, "max": max })
    }
}

impl Row {
    /// Some figure of every round.
    pub fn spread(&self, of: impl Fn(&Round) -> f64) -> Option<Spread> {
        Spread::of(self.rounds.iter().map(of).collect())
    }

    /// Million triangles a second, the final sync apart.
    pub fn rate(&self) -> Option<Spread> {
        self.spread(|r| self.triangles as f64 / 1e6 / r.build.seconds)
    }

    /// Seconds of the build in those of the floor of its round, on one thread and on all.
    pub fn ratios(&self) -> [Option<Spread>; 2] {
        [
            self.spread(|r| r.build.seconds / r.floor_one_thread.seconds),
            self.spread(|r| r.build.seconds / r.floor_all_threads.seconds),
        ]
    }

    /// The highest peak of all rounds.
    pub fn peak(&self) -> Peak {
        let peaks = self.rounds.iter().map(|r| r.build.peak);
        peaks.max().unwrap_or(Peak::Unknown)
    }

    /// Seconds of the final sync, where they are told apart.
    pub fn sync(&self) -> Option<Spread> {
        let known: Option<Vec<f64>> = self.rounds.iter().map(|r| r.build.sync).collect();
        known.and_then(Spread::of)
    }

    /// The round in which the build took the median time, or the next longer one.
    pub fn middle(&self) -> Option<&Round> {
        let mut rounds: Vec<_> = self.rounds.iter().collect();
        rounds.sort_by(|a, b| a.build.seconds.total_cmp(&b.build.seconds));
        rounds.get(rounds.len() / 2).copied()
    }

    /// Each bar with its verdict, such as `16 Mtri/s: met`; `others` are the rows of the same page.
    pub fn verdicts(&self, bars: &Bars, others: &[Row]) -> Vec<String> {
        let verdict = |bar: String, met: Option<bool>| match met {
            _ if self.refused.is_some() => format!("{bar}: **missed**, refused"),
            Some(true) => format!("{bar}: met"),
            Some(false) => format!("{bar}: **missed**"),
            None => format!("{bar}: not measured"),
        };
        let mut all = Vec::new();
        if let Some(bar) = bars.rate {
            let met = self.rate().map(|rate| rate.median() >= bar);
            all.push(verdict(format!("{bar} Mtri/s"), met));
        }
        if let Some(bar) = bars.floor {
            let met = self.ratios()[0].map(|ratio| ratio.median() <= bar);
            all.push(verdict(format!("{bar} x floor"), met));
        }
        if let Some(bar) = bars.peak {
            let peak = self.peak().bytes();
            let met = peak.map(|bytes| bytes as f64 <= bar * f64::from(1 << 20));
            all.push(verdict(format!("{bar} MiB"), met));
        }
        if let Some((name, bar)) = bars.against {
            let other = others.iter().find(|row| row.name == name);
            let times = other.and_then(|other| self.times(other));
            let found = times.map_or(String::new(), |times| format!(" (is {times:.2})"));
            let met = times.map(|times| times <= bar);
            all.push(verdict(format!("{bar} x {name} a triangle{found}"), met));
        }
        all
    }

    /// Seconds a triangle in those of another row.
    fn times(&self, other: &Row) -> Option<f64> {
        Some(other.rate()?.median() / self.rate()?.median())
    }

    /// The row with what follows from its rounds, for programs.
    pub fn json(&self, verdicts: &[String]) -> Value {
        let [one, all] = self.ratios();
        let mut value = json!(self);
        value["million_triangles_a_second"] = json!(self.rate().map(Spread::json));
        value["ratio_to_floor_one_thread"] = json!(one.map(Spread::json));
        value["ratio_to_floor_all_threads"] = json!(all.map(Spread::json));
        value["peak_resident_bytes"] = json!(self.peak().bytes());
        value["verdicts"] = json!(verdicts);
        value
    }
}
