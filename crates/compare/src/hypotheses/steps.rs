//! Solvers with steps; the step sizes and tolerances follow from the candidate.

use super::fit::Fit;
use super::play::{Played, Traced};
use super::stepper::{Scheme, Stepper, Stop};
use super::{Bench, Change};
use crate::diagnosis::round_above;
use crate::reference::Physics;
use stickslip_engine::workers::over_processors;
use stickslip_system::record::EventKind;

/// Steps up to this times the interval of samples are as long as it.
const LONGER: f64 = 1.001;
/// Longer steps than a natural period divided by this are long.
const LONG: f64 = 20.0;
const PARTS: [f64; 4] = [1.0, 2.0, 5.0, 10.0];
/// Steps in a natural period for a first estimate of a method's error.
const FINE: f64 = 100.0;

fn fine(order: i32) -> f64 {
    match order {
        1 => 2000.0,
        2 => 200.0,
        _ => 40.0,
    }
}
/// Tolerance of whole numbers of steps in an interval, and of intervals in a step.
const WHOLE: f64 = 0.05;
/// Most multiples of a step; tolerance of event times, in steps; and fewest events.
const MOST_MULTIPLES: u32 = 200_000;
const OFF: f64 = 1e-3;
const FEWEST_EVENTS: usize = 5;
/// A stick begins below this part of slip speeds.
const SLOW: f64 = 0.3;
const STICKS: usize = 20;
const FITTED: usize = 2;
/// Typical digits of tolerances, over this many decades below the largest.
const USUAL: [f64; 3] = [1.0, 2.0, 5.0];
const DECADES: i32 = 4;
/// Most natural periods by which a stick is earlier than the reference's.
const NEAR: f64 = 0.125;

impl Bench<'_> {
    pub(super) fn stepper(&self, scheme: Scheme, located: bool, step: f64) -> Stepper {
        Stepper {
            step,
            scheme,
            stop: Stop::Sign,
            located,
            late_slips: false,
            shows_before: false,
            strict: false,
            even: false,
            breakaway: 1.0,
            digit: 0.0,
        }
    }

    fn variants(&self, stepper: Stepper) -> Vec<Stepper> {
        // The end of each step is a sample, or there are several between two samples.
        let longest = self
            .evidence
            .observation
            .map_or(f64::INFINITY, |seen| seen.interval.unwrap_or(seen.spacing));
        match stepper.located {
            _ if stepper.step > LONGER * longest => Vec::new(),
            true => vec![stepper],
            false => {
                let stricts: &[bool] = match stepper.stop {
                    Stop::Within(band) | Stop::Frozen(band) if band > 0.0 => &[false, true],
                    _ => &[false],
                };
                // The variant matters if a step is long, or if a slip begins with a remaining speed.
                let matters = stepper.step * LONG > self.evidence.period || matches!(stepper.stop, Stop::Frozen(_));
                let evens: &[bool] = match stepper.scheme.order() {
                    Some(_) if matters => &[false, true],
                    _ => &[false],
                };
                let each = stricts.iter().flat_map(|&strict| [(strict, false), (strict, true)]);
                let each =
                    each.flat_map(|(strict, shows_before)| evens.iter().map(move |&even| (strict, shows_before, even)));
                each.map(|(strict, shows_before, even)| Stepper {
                    shows_before,
                    strict,
                    even,
                    ..stepper
                })
                .collect()
            }
        }
    }

    pub(super) fn stepped(&self, stepper: &Stepper, rows: usize) -> Option<Played> {
        self.stepped_from(self.physics, stepper, 1.0, rows)
    }

    /// Like [`Self::stepped`], with other parameters of the case, or from a multiple of the state.
    pub(super) fn stepped_from(
        &self,
        physics: &Physics,
        stepper: &Stepper,
        factor: f64,
        rows: usize,
    ) -> Option<Played> {
        let (time, state) = self.origin.as_ref().filter(|_| !self.limit.is_over())?;
        let state: Vec<f64> = state.iter().map(|y| factor * y).collect();
        let seen = self.evidence.observation;
        let kicks = &self.kicked(&physics.trains).kicks;
        let mut played = stepper.play(physics, (*time, &state), kicks, seen, (self.evidence.covered.1, rows))?;
        if let Some(seen) = seen {
            seen.complete(&mut played.values, self.physics, &physics.course, 0.0);
        }
        Some(played)
    }

    fn shown(&self) -> usize {
        self.evidence.observation.map_or(0, |seen| seen.time.len())
    }

    fn interval(&self) -> Option<f64> {
        self.evidence.observation.and_then(|observation| observation.interval)
    }

    /// The longest step of which the candidate's event times, counted from its start, are multiples, s.
    fn grid_of_events(&self) -> Option<f64> {
        let (from, _) = self.origin.as_ref()?;
        let times: Vec<f64> = self
            .evidence
            .word
            .iter()
            .map(|event| event.time - from)
            .filter(|time| *time > 0.0)
            .collect();
        let first = *times
            .first()
            .filter(|_| times.len() >= FEWEST_EVENTS && self.evidence.detected.is_none())?;
        let is_step = |step: &f64| {
            let off = |time: &f64| (time / step - (time / step).round()).abs();
            times.iter().all(|time| off(time) <= OFF)
        };
        (1..MOST_MULTIPLES).map(|n| first / f64::from(n)).find(is_step)
    }

    fn lengths(&self) -> Vec<f64> {
        let of_samples = self
            .interval()
            .into_iter()
            .flat_map(|interval| PARTS.map(|parts| interval / parts));
        let mut lengths: Vec<f64> = of_samples.chain(self.grid_of_events()).collect();
        lengths.sort_by(f64::total_cmp);
        lengths.dedup_by(|a, b| (*a / *b - 1.0).abs() < 1e-6);
        lengths
    }

    /// The steps at which the error of a method is most like the candidate's difference.
    fn length_of(&self, scheme: Scheme, located: bool) -> Vec<f64> {
        let Some(order) = scheme.order() else { return Vec::new() };
        let begin = self
            .interval()
            .map_or(f64::INFINITY, |interval| interval)
            .min(self.evidence.period / fine(order));
        let window = self.evidence.window(&self.evidence.reference());
        let play = |step: f64| self.stepped(&self.stepper(scheme, located, step), window);
        let Some(step) = self.evidence.projected(begin, order, &play) else {
            return Vec::new();
        };
        let Some(interval) = self.interval() else {
            return vec![step];
        };
        // Most solvers take a whole number of steps in an interval of samples.
        let parts = [(interval / step).floor(), (interval / step).ceil()];
        let near = parts
            .into_iter()
            .filter(|parts| *parts >= 1.0)
            .map(|parts| interval / parts);
        let mut near: Vec<f64> = near
            .filter(|whole| (whole / step - 1.0).abs() <= WHOLE || *whole > 0.5 * step)
            .collect();
        near.push(step);
        near.dedup();
        near
    }

    pub(super) fn steppers(&self, tolerances: &[f64], breakaway: Option<f64>) -> Vec<Stepper> {
        let lengths = self.lengths();
        let mut all = Vec::new();
        for scheme in [Scheme::Exact, Scheme::RungeKutta] {
            for &step in &lengths {
                all.push(self.stepper(scheme, false, step));
                all.push(Stepper {
                    late_slips: true,
                    ..self.stepper(scheme, true, step)
                });
                for &tolerance in tolerances.iter().chain([&0.0]) {
                    for stop in [Stop::Within(tolerance), Stop::Frozen(tolerance)] {
                        if stop == Stop::Within(0.0) {
                            continue;
                        }
                        all.push(Stepper {
                            stop,
                            ..self.stepper(scheme, false, step)
                        });
                    }
                }
                // Torques at the ends of steps exceed the limit; the intended limit is a round number.
                let near = breakaway
                    .into_iter()
                    .flat_map(|share| [share, (100.0 * share).round() / 100.0]);
                all.extend(near.filter(|share| *share != 1.0).map(|breakaway| Stepper {
                    breakaway,
                    ..self.stepper(scheme, false, step)
                }));
            }
        }
        all.into_iter().flat_map(|stepper| self.variants(stepper)).collect()
    }

    /// Typical velocity tolerances for the candidate's own steps. They are needed if no sample shows a speed at a
    /// stick.
    pub(super) fn usual_bands(&self) -> Vec<Stepper> {
        if !self.physics.sticks() {
            return Vec::new();
        }
        let lengths: Vec<f64> = self.interval().into_iter().chain(self.grid_of_events()).collect();
        let largest = SLOW * self.physics.speed();
        let power = 10f64.powf(largest.log10().floor());
        let digits = (0..DECADES).flat_map(|decade| USUAL.map(|digit| digit * power * 0.1f64.powi(decade)));
        let bands: Vec<f64> = digits.filter(|band| *band <= largest).collect();
        let stops = bands.iter().flat_map(|&band| [Stop::Within(band), Stop::Frozen(band)]);
        let stops: Vec<Stop> = stops.collect();
        let mut all = Vec::new();
        for scheme in [Scheme::Exact, Scheme::RungeKutta] {
            for &step in &lengths {
                let each = stops.iter().map(|&stop| Stepper {
                    stop,
                    ..self.stepper(scheme, false, step)
                });
                all.extend(each.flat_map(|stepper| self.variants(stepper)));
            }
        }
        all
    }

    pub(super) fn methods(&self) -> Vec<Stepper> {
        let methods: Vec<(Scheme, bool)> = Scheme::ALL
            .into_iter()
            .filter(|scheme| scheme.order().is_some())
            .flat_map(|scheme| [false, true].map(|located| (scheme, located)))
            .collect();
        let lengths = self.lengths();
        let found = over_processors(methods.len(), &|| false, |k| {
            let (scheme, located) = methods[k];
            let mut steps = self.length_of(scheme, located);
            if !located {
                steps.extend(&lengths);
            }
            let each = steps.into_iter().map(|step| self.stepper(scheme, located, step));
            each.flat_map(|stepper| self.variants(stepper)).collect::<Vec<_>>()
        });
        found.into_iter().flatten().collect()
    }

    /// Sticks that begin at a velocity. Returns tolerances for solvers with steps, from the reference's and the
    /// candidate's speed when the candidate begins to stick, and located sticks.
    pub(super) fn bands(&self, traced: &mut Traced) -> (Vec<f64>, Vec<Change>) {
        let sticks = self.evidence.word.iter().filter(|event| event.kind == EventKind::Stick);
        let at = |time: f64| {
            let (_, y) = traced.state_at(time)?;
            let system = self.physics.system();
            Some(system.relative_velocity(&traced.course.outside(time), &y).abs())
        };
        // If a stick is early, the reference has the speed at which it begins.
        let close = |time: f64| {
            let mut near = self
                .evidence
                .reference
                .iter()
                .filter(|event| event.kind == EventKind::Stick);
            near.any(|event| event.time > time && event.time - time < NEAR * self.evidence.period)
        };
        let early: Vec<f64> = sticks
            .map(|event| event.time)
            .filter(|time| close(*time))
            .take(STICKS)
            .collect();
        let is_band = |speed: &f64| *speed > 1e-6 * self.physics.speed() && *speed < SLOW * self.physics.speed();
        let speeds: Vec<f64> = early.into_iter().filter_map(at).filter(is_band).collect();
        let largest_early = speeds.iter().copied().fold(0.0, f64::max);
        // A stick declared at the end of a step shows less than the tolerance then, or after it if the surfaces keep
        // moving.
        let shown: Vec<[f64; 2]> = self.evidence.observation.map_or_else(Vec::new, |seen| {
            let sticks = self.evidence.word.iter().filter(|event| event.kind == EventKind::Stick);
            sticks.filter_map(|event| seen.speeds_near(event.time)).collect()
        });
        let largest = [0, 1].map(|side| shown.iter().map(|speeds| speeds[side]).fold(0.0, f64::max));
        let step = self.evidence.period / FINE;
        let least = 1e-3 * self.physics.speed();
        let kinds = speeds.iter().take(FITTED).chain([&least]);
        let kinds: Vec<(f64, bool)> = kinds.flat_map(|&speed| [(speed, false), (speed, true)]).collect();
        let found = over_processors(kinds.len(), &|| false, |k| {
            let (speed, frozen) = kinds[k];
            let of = |values: &[f64]| Stepper {
                stop: if frozen {
                    Stop::Frozen(values[0].abs())
                } else {
                    Stop::Within(values[0].abs())
                },
                ..self.stepper(Scheme::Exact, true, step)
            };
            let play = |values: &[f64]| self.stepped(&of(values), self.shown());
            let speed = match speed == least {
                true => self
                    .evidence
                    .projected(speed, 1, &|speed| self.stepped(&of(&[speed]), self.shown()))?,
                false => speed,
            };
            let fit = Fit {
                evidence: &self.evidence,
                play: &play,
                units: &[speed],
            };
            Some(Change::Stepper(of(&fit.refined(vec![speed])?.values)))
        });
        let tolerances = Some(largest_early).into_iter().filter(is_band).flat_map(round_above);
        let declared = largest.into_iter().filter(is_band);
        let tolerances = tolerances.chain(declared.flat_map(round_above));
        (tolerances.collect(), found.into_iter().flatten().collect())
    }
}
