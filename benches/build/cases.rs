//! The rows of the bench, by name: a mesh, a budget, and what is asked of the build.
//!
//! A bar is what the project promises; a row without bars is measured so that a change shows.
//! Rows on the same mesh stand together, so that it is made once.

use std::fmt;

/// The budget of a row.
#[derive(Clone, Debug, PartialEq)]
pub enum Memory {
    /// As `--memory` takes it.
    Stated(&'static str),
    /// A quarter of the bytes of the input.
    Quarter,
}

/// A mesh, as data-gen's command line makes it.
#[derive(Clone, Debug, PartialEq)]
pub struct Shape {
    /// Its kind.
    pub kind: &'static str,
    /// How many triangles, about: 500k, 8M, 1G.
    pub triangles: String,
    /// The order of triangles and vertices.
    pub order: &'static str,
    /// The probability that a triangle is flipped.
    pub flip: f64,
    /// What the file's name ends in: npy or stl.
    pub format: &'static str,
    /// Whether coordinates are written beside V.
    pub positions: bool,
}

impl fmt::Display for Shape {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} {}, {}", self.kind, self.triangles, self.order)?;
        if self.flip > 0.0 {
            write!(f, ", {:.0} % flipped", 100.0 * self.flip)?;
        }
        match (self.format, self.positions) {
            ("npy", true) => Ok(()),
            ("npy", false) => f.write_str(", V alone"),
            (other, _) => write!(f, ", {other}"),
        }
    }
}

/// What a row is held to; none of it is asserted.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Bars {
    /// Million triangles a second, at least.
    pub rate: Option<f64>,
    /// Seconds in those of the floor on one thread, at most.
    pub floor: Option<f64>,
    /// Peak resident memory in MiB, at most.
    pub peak: Option<f64>,
    /// Seconds a triangle in those of another row, at most.
    pub against: Option<(&'static str, f64)>,
}

/// A row.
#[derive(Clone, Debug, PartialEq)]
pub struct Case {
    /// Its name, for `--only`.
    pub name: String,
    /// The mesh.
    pub shape: Shape,
    /// The budget.
    pub memory: Memory,
    /// What it is held to.
    pub bars: Bars,
    /// Runs on request alone, and once.
    pub large: bool,
    /// NumPy and SciPy take turns with the build.
    pub scipy: bool,
    /// Vertices are not measured.
    pub bare: bool,
}

/// A row on a sphere of .npy with coordinates, in 512 MiB and without bars.
fn sphere(name: &str, triangles: &str, order: &'static str, flip: f64) -> Case {
    Case {
        name: name.into(),
        shape: Shape {
            kind: "sphere",
            triangles: triangles.into(),
            order,
            flip,
            format: "npy",
            positions: true,
        },
        memory: Memory::Stated("512MiB"),
        bars: Bars::default(),
        large: false,
        scipy: false,
        bare: false,
    }
}

impl Case {
    /// Asks for a rate in Mtri/s within a peak in MiB.
    fn bar(mut self, rate: f64, peak: f64) -> Case {
        (self.bars.rate, self.bars.peak) = (Some(rate), Some(peak));
        self
    }

    fn within(mut self, memory: &'static str) -> Case {
        self.memory = Memory::Stated(memory);
        self
    }

    /// Asks that a triangle take at most `times` as long as in the row `name`.
    fn against(mut self, name: &'static str, times: f64) -> Case {
        self.bars.against = Some((name, times));
        self
    }

    fn stl(mut self) -> Case {
        self.shape.format = "stl";
        self
    }

    /// The mesh in words, and what is left out.
    pub fn words(&self) -> String {
        let out = if self.bare { ", no measures" } else { "" };
        format!("{}{out}", self.shape)
    }

    /// The same without measures, held to nothing.
    fn bare(mut self, name: &str) -> Case {
        (self.name, self.bare) = (name.into(), true);
        self.bars = Bars::default();
        self
    }

    fn kind(mut self, kind: &'static str) -> Case {
        self.shape.kind = kind;
        self
    }

    fn large(mut self) -> Case {
        self.large = true;
        self
    }

    fn beside_scipy(mut self) -> Case {
        self.scipy = true;
        self
    }

    /// The same in a quarter of the input's bytes, held to nothing.
    fn in_a_quarter(&self) -> Case {
        Case {
            name: format!("{}-q", self.name),
            memory: Memory::Quarter,
            bars: Bars::default(),
            scipy: false,
            ..self.clone()
        }
    }
}

/// The bars that the project states.
fn promised() -> Vec<Case> {
    let mut coherent = sphere("c32", "32M", "coherent", 0.0).bar(16.0, 576.0);
    coherent.bars.floor = Some(2.0);
    let bare = coherent.clone().bare("c32-bare");
    // Measures may cost so much that seven tenths of the speed are left.
    let coherent = coherent.against("c32-bare", 1.43);
    let shuffled = |name, triangles| sphere(name, triangles, "shuffle", 0.3);
    vec![
        bare,
        coherent,
        sphere("rv32", "32M", "shuffle-vertices", 0.0).bar(8.0, 576.0),
        shuffled("s32", "32M").bare("s32-bare"),
        shuffled("s32", "32M").bar(4.0, 576.0),
        shuffled("s32-96", "32M").within("96MiB").bar(2.0, 160.0),
        sphere("c32-stl", "32M", "coherent", 0.0)
            .stl()
            .bar(8.0, 576.0),
        shuffled("s32-stl", "32M").stl().bar(2.5, 576.0),
    ]
}

/// Every order and crowd that a build must not stumble over: ample memory, and a quarter.
fn hard() -> Vec<Case> {
    let soup = |name, order| sphere(name, "8M", order, 0.0).kind("soup");
    let hub = |name, kind| sphere(name, "10M", "shuffle", 0.3).kind(kind);
    let ample = [
        sphere("c8", "8M", "coherent", 0.0).beside_scipy(),
        sphere("s8", "8M", "shuffle", 0.3).beside_scipy(),
        sphere("rv8", "8M", "shuffle-vertices", 0.0),
        sphere("rt8", "8M", "shuffle-triangles", 0.0),
        sphere("reversed8", "8M", "reversed", 0.0),
        sphere("interleaved8", "8M", "interleaved", 0.0),
        sphere("strips8", "8M", "strips", 0.0),
        sphere("sorted8", "8M", "sorted-x", 0.0),
        soup("soup8", "coherent"),
        soup("soup8-s", "shuffle"),
        soup("soup8-stl", "shuffle").stl(),
        sphere("s10", "10M", "shuffle", 0.3),
        hub("fan10", "fan").against("s10", 3.0),
        hub("cone10", "cone").against("s10", 3.0),
        hub("book10", "book").against("s10", 3.0),
        hub("stack10", "stack").against("s10", 3.0),
    ];
    let both = |case: Case| {
        let mut quarter = case.in_a_quarter();
        quarter.bars.against = case.bars.against.map(|(_, times)| ("s10-q", times));
        [case, quarter]
    };
    ample.into_iter().flat_map(both).collect()
}

/// What takes minutes and tens of GB.
fn large() -> Vec<Case> {
    let mut alone = sphere("c1000-v", "1G", "coherent", 0.0)
        .within("1GiB")
        .bar(8.0, 1088.0);
    alone.shape.positions = false;
    let rows = [
        sphere("c256", "256M", "coherent", 0.0).against("c8", 1.3),
        sphere("s256", "256M", "shuffle", 0.3).bar(2.0, 576.0),
        alone,
    ];
    rows.into_iter().map(Case::large).collect()
}

/// Meshes of four times the budget, hubs and soups of twice: the budget and 64 MiB is all that they
/// may take. At 64 MiB `tests/memory.rs` holds the same.
fn kept() -> Vec<Case> {
    let budgets = [
        ("m", "256MiB", 320.0, ["60M", "32M", "12M"]),
        ("g", "1GiB", 1088.0, ["240M", "120M", "46M"]),
    ];
    let rows = |(name, memory, peak, [surface, hub, soup]): (&str, _, _, [&str; 3])| {
        let row = |kind: &'static str, triangles, order, flip| {
            let name = format!("kept-{kind}-{order}-{name}");
            let mut case = sphere(&name, triangles, order, flip);
            case.bars.peak = Some(peak);
            case.kind(kind).within(memory).large()
        };
        [
            row("sphere", surface, "coherent", 0.0),
            row("sphere", surface, "shuffle", 0.3),
            row("cone", hub, "shuffle", 0.3),
            row("soup", soup, "shuffle", 0.0),
        ]
    };
    budgets.into_iter().flat_map(rows).collect()
}

/// All rows, in the order of the page.
pub fn all() -> Vec<Case> {
    [promised(), hard(), large(), kept()].concat()
}

/// Every mesh of the table once, of `triangles` triangles in little memory: for CI.
pub fn quick(triangles: &str) -> Vec<Case> {
    let mut rows: Vec<Case> = Vec::new();
    for mut case in all() {
        case.shape.triangles = triangles.into();
        if !rows.iter().any(|row| row.shape == case.shape) {
            case.memory = Memory::Stated("32MiB");
            case.bars = Bars::default();
            case.scipy = rows.is_empty();
            rows.push(case);
        }
    }
    rows
}
