//! What a recorded sample becomes a small time later or earlier in its own mode.

use super::readings::{Brake, Readings, TwistReadings};
use crate::model::state::{Components, DIMENSION, TorsionState};
use crate::model::torsion::TorsionModel;
use crate::model::{Axial, Parameters};
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

/// The equations of a case near its recorded samples.
#[derive(Debug)]
pub(crate) struct Nearby {
    brake: Brake,
    axial: Axial,
}

impl Nearby {
    /// Of a case.
    pub fn new(parameters: &Parameters) -> Nearby {
        Nearby {
            brake: Brake {
                torsion: TorsionModel::new(parameters),
                axial: parameters.axial_motion(),
            },
            axial: parameters.axial,
        }
    }

    /// By how much each of the [`columns`] changes from a sample to `dt` (s) after it, in the sample's mode: one step of the
    /// classical Runge-Kutta method for the torsion, the closed form for the axial motion. For |dt| up to a hundredth of the
    /// natural period it errs by some 1e-8 of the oscillation. What the record of a run adds up, the work of kicks and the residual
    /// of the energy, does not change.
    pub fn change(&self, sample: &Sample, dt: f64) -> [f64; COLUMNS] {
        let (t, mode) = (sample.time, sample.mode);
        let y = self.state_vector(sample);
        let mut later = y;
        let mut slopes = [[0.0; DIMENSION]; 4];
        for (stage, share) in [0.0, 0.5, 0.5, 1.0].into_iter().enumerate() {
            let mut at = y;
            if stage > 0 {
                for (x, slope) in at.iter_mut().zip(slopes[stage - 1]) {
                    *x += share * dt * slope;
                }
            }
            let now = t + share * dt;
            slopes[stage] = self
                .brake
                .torsion
                .rates_at(mode, || self.brake.axial.pressing_force(now), &at);
        }
        for (k, x) in later.iter_mut().enumerate() {
            *x += dt / 6.0 * (slopes[0][k] + 2.0 * (slopes[1][k] + slopes[2][k]) + slopes[3][k]);
        }
        let readings = TwistReadings {
            brake: &self.brake,
            axial: self.axial,
        };
        let read = |t: f64, y: &TorsionState| joined(&readings.state(t, &mode, y), &readings.channels(t, &mode, y));
        let (before, after) = (read(t, &y), read(t + dt, &later));
        std::array::from_fn(|k| after[k] - before[k])
    }

    fn state_vector(&self, sample: &Sample) -> TorsionState {
        let channels = &sample.channels;
        Components {
            friction_loss: channels.dissipated_friction,
            damping_loss: channels.dissipated_damping - self.brake.axial.at(sample.time).dissipated,
            ..sample.state.torsional()
        }
        .state()
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
        let nearby = Nearby::new(&Parameters::of(&case.system).unwrap());
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
