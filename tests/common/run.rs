//! Runs the program as a user would, and keeps what it said.

use std::ffi::OsStr;
use std::fs::File;
use std::os::unix::process::ExitStatusExt;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

/// A run that takes longer hangs: the meshes here are small.
const PATIENCE: Duration = Duration::from_secs(300);

/// What a finished run left.
#[derive(Debug)]
pub struct Run {
    /// The exit code, or 128 + the signal.
    pub code: i32,
    pub stdout: String,
    pub stderr: String,
    pub command: String,
}

impl Run {
    /// Panics with everything said unless the code is `code`.
    #[track_caller]
    pub fn expect(self, code: i32) -> Run {
        assert!(self.code == code, "expected exit code {code}\n{self}");
        self
    }
}

impl std::fmt::Display for Run {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Run {
            code,
            stdout,
            stderr,
            command,
        } = self;
        write!(
            f,
            "{command}\nexit code {code}\nstdout: {stdout}\nstderr: {stderr}"
        )
    }
}

/// Runs `cornermill` with `args`.
pub fn cornermill<S: AsRef<OsStr>>(args: impl IntoIterator<Item = S>) -> Run {
    let mut command = Command::new(env!("CARGO_BIN_EXE_cornermill"));
    command.args(args);
    run(command, Stdio::null())
}

/// Runs `cornermill` with `args`, reading `input` as its standard input.
pub fn cornermill_reading<S: AsRef<OsStr>>(input: &Path, args: impl IntoIterator<Item = S>) -> Run {
    let mut command = Command::new(env!("CARGO_BIN_EXE_cornermill"));
    command.args(args);
    run(command, File::open(input).expect("input opens").into())
}

/// Runs `cornermill` in an address space of `mib` MiB, and with files of at most as much: an
/// allocation from a header's claim then fails, in memory or on disk, before it hurts anyone.
pub fn cornermill_confined<S: AsRef<OsStr>>(mib: u32, args: impl IntoIterator<Item = S>) -> Run {
    let mut command = Command::new("sh");
    // Kibibytes of memory, 512-byte blocks of files; going beyond the latter ends the process.
    let limits = format!("ulimit -v {} && ulimit -f {}", mib * 1024, mib * 2048);
    let script = format!("{limits} && exec \"$0\" \"$@\"");
    command
        .args(["-c", &script, env!("CARGO_BIN_EXE_cornermill")])
        .args(args);
    run(command, Stdio::null())
}

/// Runs any command to its end; standard output and error go through files, so none can block.
pub fn run(mut command: Command, stdin: Stdio) -> Run {
    let text = format!("{command:?}");
    let dir = tempfile::tempdir().expect("a temporary directory");
    let (out, err) = (dir.path().join("stdout"), dir.path().join("stderr"));
    command.stdin(stdin);
    command.stdout(File::create(&out).expect("stdout file"));
    command.stderr(File::create(&err).expect("stderr file"));
    let mut child = command.spawn().unwrap_or_else(|e| panic!("{text}: {e}"));
    let start = Instant::now();
    let status = loop {
        if let Some(status) = child.try_wait().expect("waiting for the child") {
            break status;
        }
        if start.elapsed() > PATIENCE {
            child.kill().expect("ending a child that hangs");
            panic!("{text}: still running after {PATIENCE:?}");
        }
        std::thread::sleep(Duration::from_millis(1));
    };
    let said =
        |path| String::from_utf8_lossy(&std::fs::read(path).unwrap_or_default()).into_owned();
    let code = status
        .code()
        .unwrap_or_else(|| 128 + status.signal().unwrap_or(0));
    Run {
        code,
        stdout: said(&out),
        stderr: said(&err),
        command: text,
    }
}
