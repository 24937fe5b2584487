//! Sizes in bytes as people write them, and the memory limit that the process sees.

use std::fs;
use std::path::Path;
use std::str::FromStr;

/// A number of bytes with a unit, or a percentage of a limit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Size {
    /// Bytes.
    Bytes(u64),
    /// Percent of the memory limit.
    Percent(f64),
}

impl FromStr for Size {
    type Err = String;

    fn from_str(text: &str) -> Result<Size, String> {
        let text = text.trim();
        let split = text.find(|c: char| !c.is_ascii_digit() && c != '.');
        let (number, unit) = text.split_at(split.unwrap_or(text.len()));
        let number: f64 = number
            .parse()
            .map_err(|_| format!("'{text}' is no size; write for example 512MiB, 2GB or 25%"))?;
        let factor: u64 = match unit.trim() {
            "B" => 1,
            "KiB" => 1 << 10,
            "MiB" => 1 << 20,
            "GiB" => 1 << 30,
            "TiB" => 1 << 40,
            "kB" | "KB" => 1_000,
            "MB" => 1_000_000,
            "GB" => 1_000_000_000,
            "TB" => 1_000_000_000_000,
            "%" if number > 0.0 && number <= 100.0 => return Ok(Size::Percent(number)),
            "" => return Err(format!("'{text}' has no unit; write for example {text}MiB")),
            "%" => {
                return Err(format!(
                    "'{text}' is no share; it is above 0 % and at most 100 %"
                ));
            }
            unit => {
                return Err(format!(
                    "unknown unit '{unit}'; use KiB MiB GiB, kB MB GB, B or %"
                ));
            }
        };
        Ok(Size::Bytes((number * factor as f64) as u64))
    }
}

impl Size {
    /// Bytes, given what 100 % is.
    pub fn bytes(self, limit: u64) -> u64 {
        match self {
            Size::Bytes(bytes) => bytes,
            Size::Percent(percent) => (limit as f64 * percent / 100.0) as u64,
        }
    }
}

/// The memory limit that the process sees: its control group's, else the machine's.
pub fn memory_limit() -> u64 {
    let machine = meminfo("/proc/meminfo").unwrap_or(8 << 30);
    cgroup_limit(Path::new("/proc/self/cgroup"), Path::new("/sys/fs/cgroup"))
        .map_or(machine, |limit| limit.min(machine))
}

fn meminfo(path: &str) -> Option<u64> {
    let text = fs::read_to_string(path).ok()?;
    let line = text.lines().find_map(|l| l.strip_prefix("MemTotal:"))?;
    let kib: u64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    Some(kib << 10)
}

/// The least limit of the process's control group and the groups above it, in the one-tree
/// layout (`memory.max`) and the layout with a tree for each resource
/// (`memory.limit_in_bytes`).
fn cgroup_limit(own: &Path, root: &Path) -> Option<u64> {
    let text = fs::read_to_string(own).ok()?;
    let mut least = None;
    for line in text.lines() {
        let mut parts = line.splitn(3, ':');
        let (Some(_), Some(kinds), Some(group)) = (parts.next(), parts.next(), parts.next()) else {
            continue;
        };
        let (tree, file) = if kinds.is_empty() {
            (root.to_owned(), "memory.max")
        } else if kinds.split(',').any(|k| k == "memory") {
            (root.join("memory"), "memory.limit_in_bytes")
        } else {
            continue;
        };
        let mut dir = tree.join(group.trim_start_matches('/'));
        loop {
            let limit = fs::read_to_string(dir.join(file)).ok();
            let limit = limit.and_then(|l| l.trim().parse::<u64>().ok());
            least = limit.map_or(least, |l| Some(least.map_or(l, |m: u64| m.min(l))));
            // In a container the group's path may not exist under the root; the root does.
            if dir == tree || !dir.pop() {
                break;
            }
        }
    }
    least
}

/// Bytes for people: at most three digits before a binary unit.
pub fn show(bytes: u64) -> String {
    let mut value = bytes as f64;
    for unit in ["B", "KiB", "MiB", "GiB"] {
        if value < 1024.0 {
            return if unit == "B" {
                format!("{bytes} B")
            } else {
                format!("{value:.1} {unit}")
            };
        }
        value /= 1024.0;
    }
    format!("{value:.1} TiB")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_with_units_and_without() {
        assert_eq!("512MiB".parse(), Ok(Size::Bytes(512 << 20)));
        assert_eq!("1.5 GB".parse(), Ok(Size::Bytes(1_500_000_000)));
        assert_eq!("25%".parse::<Size>().map(|s| s.bytes(1000)), Ok(250));
        for bad in ["512", "", "MiB", "5 parsecs", "0%", "101%", "-1MiB", "1e9"] {
            assert!(bad.parse::<Size>().is_err(), "{bad}");
        }
    }

    #[test]
    fn the_least_limit_of_the_group_and_those_above_counts() {
        let dir = tempfile::tempdir().unwrap();
        let own = dir.path().join("cgroup");
        fs::write(&own, "9:name=x:/\n4:cpu,memory:/a/b\n0::/a\n").unwrap();
        fs::create_dir_all(dir.path().join("memory/a/b")).unwrap();
        fs::create_dir_all(dir.path().join("a")).unwrap();
        fs::write(dir.path().join("memory/a/b/memory.limit_in_bytes"), "900\n").unwrap();
        fs::write(dir.path().join("memory/a/memory.limit_in_bytes"), "500\n").unwrap();
        fs::write(dir.path().join("a/memory.max"), "max\n").unwrap();
        assert_eq!(cgroup_limit(&own, dir.path()), Some(500));
        fs::write(dir.path().join("a/memory.max"), "400\n").unwrap();
        assert_eq!(cgroup_limit(&own, dir.path()), Some(400));
    }
}
