//! What a recorded sample becomes a small time later or earlier in its own mode.

use super::readings::Readings;
use super::trains::{TrainDynamics, TrainLocation, TrainReadings, Watch};
use crate::hybrid::Dynamics;
use crate::model::trains::Trains;
use crate::model::trains::system::Outside;
use crate::record::{Channels, Sample, State};

/// Every column of a row of the trajectory: the states, then the other channels.
pub const COLUMNS: usize = State::COUNT + Channels::COUNT;

/// Name, UDUNITS unit and description of each of the [`COLUMNS`].
pub fn columns() -> impl Iterator<Item = &'static (&'static str, &'static str, &'static str)> {
    State::DESCRIPTIONS.iter().chain(Channels::DESCRIPTIONS)
}

/// The values of a sample in the order of [`columns`].
pub fn values(sample: &Sample) -> [f64; COLUMNS] {
    joined(&sample.state, &sample.channels)
}

fn joined(state: &State, channels: &Channels) -> [f64; COLUMNS] {
    let mut all = [0.0; COLUMNS];
    all[..State::COUNT].copy_from_slice(&state.values());
    all[State::COUNT..].copy_from_slice(&channels.values());
    all
}

/// The equations of a case near its recorded samples, whose [`State`] is all of the state: a free rotor of two inertias and a fixed
/// stator of one.
#[derive(Debug)]
pub(crate) struct Nearby {
    dynamics: TrainDynamics,
}

impl Nearby {
    /// Of a system.
    pub fn new(trains: &Trains) -> Nearby {
        Nearby {
            dynamics: TrainDynamics::new(trains, 0.0),
        }
    }

    /// The shorter period of a surface on its shaft, s; `None` where nothing moves by itself.
    pub fn natural_period(&self) -> Option<f64> {
        self.dynamics.natural_period()
    }

    /// By how much each of the [`columns`] changes from a sample to `dt` (s) after it, in the sample's mode: one step of the
    /// classical Runge-Kutta method for the torsion, the closed form for the axial motion. For |dt| up to a hundredth of the
    /// natural period it errs by some 1e-8 of the oscillation. What the record of a run adds up, the work of kicks and the residual
    /// of the energy, does not change.
    pub fn change(&self, sample: &Sample, dt: f64) -> [f64; COLUMNS] {
        let t = sample.time;
        let y = self.state_vector(&sample.state);
        let mut location = TrainLocation {
            mode: sample.mode,
            sense: sample.mode.sense(),
            piece: self.dynamics.system.piece_of(sample.state.relative_velocity),
            stretch: 0,
            slow: false,
            watch: Watch::Off,
            resolved: true,
        };
        let mut at = |t: f64| {
            location.stretch = self.dynamics.excitation.stretch(t);
            location
        };
        let mut later = y.clone();
        let mut slope = vec![0.0; y.len()];
        for (share, weight) in [(0.0, 1.0), (0.5, 2.0), (0.5, 2.0), (1.0, 1.0)] {
            let stage: Vec<f64> = y.iter().zip(&slope).map(|(y, slope)| y + share * dt * slope).collect();
            let now = t + share * dt;
            self.dynamics.rhs(&at(now), now, &stage, &mut slope);
            for (later, slope) in later.iter_mut().zip(&slope) {
                *later += dt / 6.0 * weight * slope;
            }
        }
        let readings = TrainReadings {
            dynamics: &self.dynamics,
            further: false,
        };
        let read = |t: f64, place: TrainLocation, y: &[f64]| {
            joined(&readings.state(t, &place, y), &readings.channels(t, &place, y))
        };
        let before = read(t, at(t), &y);
        let after = read(t + dt, at(t + dt), &later);
        std::array::from_fn(|k| after[k] - before[k])
    }

    /// Of the disks, J.
    pub fn kinetic_energy(&self, state: &State) -> f64 {
        let system = &self.dynamics.system;
        system.kinetic_energy(&Outside::default(), &self.state_vector(state))
    }

    /// Losses and work begin at zero.
    fn state_vector(&self, state: &State) -> Vec<f64> {
        let system = &self.dynamics.system;
        let mut y = vec![0.0; system.dimension];
        let (rotor, stator) = (system.rotor.twists, system.stator.twists);
        (y[rotor], y[rotor + 1]) = (state.rotor_twist, state.rotor_twist_rate);
        (y[stator], y[stator + 1]) = (state.phi1, state.phi1_dot);
        if let Some(speed) = system.rotor.speed {
            y[speed] = state.theta_dot;
        }
        y[system.slip] = state.slip_displacement;
        y
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::case::{Case, CaseSource};
    use crate::record::MemoryRecorder;
    use crate::run::Run;
    use crate::simulation::{Following, OutputOptions};

    /// From each sample of a run to the next, forward and backward, over a two-hundredth of the natural period, through slip,
    /// stick and separation: the run's own columns, to its tolerance.
    #[test]
    fn property_a_sample_moved_to_its_neighbour_is_the_neighbour() {
        let case = Case::parse(&CaseSource::built_in("release").unwrap(), &[]).unwrap();
        let output = OutputOptions {
            end_time: 0.9,
            interval: 1.2e-6,
            windows: Vec::new(),
            steps: false,
            follow: Following::default(),
        };
        let mut recorder = MemoryRecorder::default();
        Run::new(&case).output(&output).record(&mut recorder).start().unwrap();
        let nearby = Nearby::new(&Trains::from(&case.parameters));
        let mut largest = [0.0_f64; COLUMNS];
        for sample in &recorder.samples {
            for (k, x) in values(sample).into_iter().enumerate() {
                largest[k] = largest[k].max(x.abs());
            }
        }
        let mut modes = Vec::new();
        for pair in recorder.samples.windows(2) {
            let (a, b) = (&pair[0], &pair[1]);
            let between = recorder.events.iter().any(|e| (a.time..=b.time).contains(&e.time));
            if a.segment != b.segment || between {
                continue;
            }
            for (from, to) in [(a, b), (b, a)] {
                let change = nearby.change(from, to.time - from.time);
                for (k, (name, _, _)) in columns().enumerate() {
                    let error = (values(from)[k] + change[k] - values(to)[k]).abs();
                    // 1e-10 for the run, and a step's (2 pi/200)^5/120 = 3e-10 of an oscillation, which is no larger than
                    // the column; damping and friction have terms of that order too: together below 2e-8. The residual is
                    // rounding itself, of energies.
                    let scale = if *name == "energy_residual" { 1e-3 } else { largest[k] };
                    assert!(error <= 2e-8 * scale, "{name} at {}: {error:e} of {scale:e}", from.time);
                }
            }
            if !modes.contains(&a.mode) {
                modes.push(a.mode);
            }
        }
        assert_eq!(modes.len(), 3, "{modes:?}");
    }
}
