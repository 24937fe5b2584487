//! The read pass: the input becomes V and G, welded where that is asked for.
//!
//! Why the input is asked right behind its reading whether it is as it was: what is read from
//! then on are files of ours, and hours later it may be gone. Arrays that are used where they
//! lie are asked again at the end.
//!
//! Memory and I/O: see [`crate::input`].

use super::clock::Clock;
use super::identity::Inputs;
use super::steps::At;
use crate::error::Result;
use crate::input::{self, Mesh, Reading, Request};

/// Reads the mesh, or goes on where a build that was stopped left it.
///
/// # Errors
/// As [`input::read`] and [`Reading::on`]; as [`Inputs::check`].
pub fn read(clock: &mut Clock, request: &Request, inputs: &Inputs) -> Result<Mesh> {
    clock.measured(("read", "bytes", 0), |steps, ws| {
        let left = steps.left().filter(|left| input::STEPS.contains(left));
        let left = match left.map(str::to_owned) {
            Some(step) => steps.restored(&step)?,
            None => None,
        };
        let mut reading = match left {
            Some(reading) => reading,
            None => {
                let reading = ws.io.intact(input::read(ws, request))?;
                if !reading.lies_in_input() {
                    inputs.check(&ws.io)?;
                }
                reading
            }
        };
        loop {
            let (step, opened) = (reading.step(), None);
            steps.done(ws, At { step, opened }, &reading)?;
            let before = reading.lies_in_input();
            reading = match reading {
                Reading::Done(mesh) => return Ok(mesh),
                reading => ws.io.intact(reading.on(ws, request, steps.until()))?,
            };
            if before && !reading.lies_in_input() {
                inputs.check(&ws.io)?;
            }
        }
    })
}
