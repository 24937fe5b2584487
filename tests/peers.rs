//! The runner of `benches/peers` judges what other tools answer: here its judging is seen to say no.
//!
//! Needs `python3` with numpy and scipy, as `numpy_oracle` does; no peer and no network.

use std::path::Path;
use std::process::Command;

#[test]
fn the_runner_of_the_peers_can_say_no() {
    let run = Path::new(env!("CARGO_MANIFEST_DIR")).join("benches/peers/run");
    let mut command = Command::new("python3");
    command.arg(run).arg("--self-test");
    command.env("PYTHONDONTWRITEBYTECODE", "1");
    let output = command.output().expect("python3 is needed");
    let said = String::from_utf8_lossy(&output.stdout);
    assert!(
        output.status.success(),
        "{said}{}",
        String::from_utf8_lossy(&output.stderr)
    );
    assert_eq!(said.matches(": ok").count(), 4, "{said}");
}
