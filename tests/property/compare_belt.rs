//! Reports of `compare` on solvers of a block on a belt: sound ones, and solvers with one fault.

use crate::common::cases::built_in;
use crate::common::compare::{Kept, agrees, causes, events_csv, evidence, kept, series};
use std::fmt::Write;

use stickslip::compare::{CauseKind, CompareProgress, CompareStage, Comparison, Mapping, Reference};

/// The run of a case with samples at one constant interval, as from another solver.
fn made(case: &str, overrides: &[&str]) -> Kept {
    kept(&built_in(case, &[overrides, &["output.around=none"]].concat()))
}

fn belt() -> Kept {
    made("belt-leine", &[])
}

type Smooth = fn(f64) -> f64;

/// An explicit solver of Leine's belt: m = k = F_s = 1, belt speed 0.2, friction 1/(1 + 3 |w|).
#[derive(Clone, Copy)]
struct Solver {
    step: f64,
    stiffness: f64,
    damping: f64,
    /// Factor of the friction in slip.
    friction: f64,
    /// Friction force at which the stick ends.
    breakaway: f64,
    /// Whether events are located within a step instead of at its end.
    located: bool,
    /// Smooth law that replaces the stick, with its eps.
    smooth: Option<(Smooth, f64)>,
}

/// The classical Runge-Kutta method with located events. Its error in a slip is 1e-10.
const SOUND: Solver = Solver {
    step: 0.01,
    stiffness: 1.0,
    damping: 0.0,
    friction: 1.0,
    breakaway: 1.0,
    located: true,
    smooth: None,
};

const SPEED: f64 = 0.2;
const END: f64 = 100.0;

/// Rows (t, x, v) and events.
type Made = (Vec<[f64; 3]>, Vec<(f64, &'static str)>);

impl Solver {
    fn rates(&self, [x, v]: [f64; 2]) -> [f64; 2] {
        let w = SPEED - v;
        let mu = self.friction / (1.0 + 3.0 * w.abs());
        let force = self.smooth.map_or(mu, |(smooth, eps)| mu * smooth(w / eps));
        [v, -self.stiffness * x - self.damping * v + force]
    }

    fn advance(&self, y: [f64; 2], h: f64) -> [f64; 2] {
        let plus = |h: f64, k: [f64; 2]| [y[0] + h * k[0], y[1] + h * k[1]];
        let a = self.rates(y);
        let b = self.rates(plus(h / 2.0, a));
        let c = self.rates(plus(h / 2.0, b));
        let d = self.rates(plus(h, c));
        std::array::from_fn(|n| y[n] + h / 6.0 * (a[n] + 2.0 * b[n] + 2.0 * c[n] + d[n]))
    }

    fn run(&self) -> Made {
        let (mut t, mut y, mut stuck) = (0.0, [0.0, SPEED], self.smooth.is_none());
        let (mut rows, mut events) = (vec![[0.0, 0.0, SPEED]], Vec::new());
        let limit = (self.breakaway - self.damping * SPEED) / self.stiffness;
        for n in 1..=(END / self.step).round() as usize {
            let grid = n as f64 * self.step;
            while t < grid {
                let h = grid - t;
                let rest = (limit - y[0]) / SPEED;
                if stuck && self.located && rest <= h {
                    (t, y, stuck) = (t + rest, [limit, SPEED], false);
                    events.push((t, "slip"));
                } else if stuck {
                    (t, y) = (grid, [y[0] + SPEED * h, SPEED]);
                    if !self.located && y[0] > limit {
                        stuck = false;
                        events.push((t, "slip"));
                    }
                } else {
                    let next = self.advance(y, h);
                    let stops = self.smooth.is_none() && next[1] >= SPEED && y[1] < SPEED - 1e-12;
                    let (mut low, mut high) = (0.0, h);
                    for _ in 0..if stops && self.located { 60 } else { 0 } {
                        let middle = 0.5 * (low + high);
                        if self.advance(y, middle)[1] >= SPEED {
                            high = middle;
                        } else {
                            low = middle;
                        }
                    }
                    if stops {
                        (t, y, stuck) = (
                            if high < h { t + high } else { grid },
                            [self.advance(y, high)[0], SPEED],
                            true,
                        );
                        events.push((t, "stick"));
                    } else {
                        (t, y) = (grid, next);
                    }
                }
            }
            rows.push([grid, y[0], y[1]]);
        }
        (rows, events)
    }
}

fn rows_judged(reference: &Kept, rows: &[[f64; 3]]) -> Comparison {
    reference.compared(&series("t,x,v", rows.iter().copied()), |_| {})
}

/// Like [`rows_judged`] with the belt, without a search for causes.
fn rows_compared(rows: &[[f64; 3]], change: impl Fn(&mut Mapping)) -> Comparison {
    belt().compared(&series("t,x,v", rows.iter().copied()), |mapping| {
        mapping.quick = true;
        change(mapping);
    })
}

fn judge(solver: Solver) -> Comparison {
    rows_judged(&belt(), &solver.run().0)
}

fn judged_with_events(rows: &[[f64; 3]], events: &[(f64, &str)]) -> Comparison {
    let events: Vec<(f64, String)> = events.iter().map(|(time, kind)| (*time, kind.to_string())).collect();
    let belt = belt();
    let table = belt.path.with_file_name("events.csv");
    std::fs::write(&table, events_csv(&events)).unwrap();
    let series = series("t,x,v", rows.iter().copied());
    belt.compared(&series, |mapping| mapping.event_file = Some(table))
}

/// Comparison of the reference's own values after adding a constant to positions and speeds.
fn moved(position: f64, speed: f64) -> Comparison {
    let (reference, rows) = own_rows("belt-leine", ["phi1", "phi1_dot"]);
    let rows = rows.iter().map(|[t, x, v]| [*t, x + position, v + speed]);
    reference.compared(&series("t,x,v", rows), |mapping| mapping.quick = true)
}

/// The reference's own values have no error, and an added constant is found exactly.
#[test]
fn analytic_a_score_without_a_threshold_is_the_error_that_was_added() {
    let score = moved(0.0, 0.0).score.unwrap();
    let (position, period) = (score.position.as_ref().unwrap(), score.period.as_ref().unwrap());
    let (rest, creep) = (score.rest.as_ref().unwrap(), score.creep.unwrap());
    assert_eq!(score.from, 0.0);
    assert_eq!((rest.sticks, creep.sticks, period.cycles), (8, 8, [7, 7]));
    assert!((period.reference - 12.001_031_294_830_579).abs() < 1e-4, "{period:?}");
    for relative in [position.relative, period.relative, rest.relative, creep.relative] {
        assert!(relative < 1e-14, "{score:?}");
    }
    let score = moved(1e-3, 1e-4).score.unwrap();
    let (position, rest, creep) = (score.position.unwrap(), score.rest.unwrap(), score.creep.unwrap());
    assert!((position.rms - 1e-3).abs() < 1e-12 && (position.relative * position.size - 1e-3).abs() < 1e-12);
    assert!((rest.rms - 1e-3).abs() < 1e-12, "{rest:?}");
    assert!((rest.max - 1e-3).abs() < 1e-12, "{rest:?}");
    assert!((creep.rms - 1e-4).abs() < 1e-12 && creep.reference == 0.0, "{creep:?}");
    assert!((creep.candidate - 1e-4).abs() < 1e-12 && creep.size > 0.1, "{creep:?}");
    // A position that is 1 mm off crosses the reference's mean at other times, but equally often.
    assert!(score.period.unwrap().relative < 1e-4);
}

/// A regularised law creeps during sticks, and its cycles are shorter. Both are found without any of its events.
#[test]
fn published_a_regularised_law_is_seen_without_a_threshold() {
    let solver = Solver {
        smooth: Some((f64::tanh, 1e-3)),
        step: 1e-3,
        ..SOUND
    };
    let rows = solver.run().0;
    let score = rows_compared(&rows, |_| {}).score.unwrap();
    // At the end of a stick, mu = 1/(1 + 3 w) balances the spring; in its middle half, w is 1e-4 to 1e-3 m/s.
    let creep = score.creep.unwrap();
    assert!((1e-5..1e-3).contains(&creep.rms) && creep.reference == 0.0, "{creep:?}");
    let period = score.period.unwrap();
    assert!((period.error + 0.10043135).abs() < 1e-4, "{period:?}");
    // Its slips begin slowly, so they reach the higher threshold later.
    let moved = rows_compared(&rows, |mapping| {
        mapping.set_tolerance("1 mm/s").unwrap();
    });
    let effect = moved.hysteresis.unwrap();
    assert_eq!((effect.stick_begins, effect.stick_ends), (1e-3, 2e-3));
    assert!(effect.slips_later.unwrap() > 1e-3, "{effect:?}");
    let plain = rows_compared(&rows, |mapping| {
        mapping.set_tolerance("1 mm/s").unwrap();
        mapping.set_hysteresis(1.0).unwrap();
    });
    assert_eq!(plain.hysteresis, None);
    assert_eq!(plain.candidate_events, effect.events_without);
}

/// One late event is not a drift. It is the first wrong event, although a later event has a larger error.
#[test]
fn analytic_a_late_event_is_named_and_is_no_drift() {
    let (rows, mut events) = SOUND.run();
    events[6].0 += 8.58e-3;
    let c = judged_with_events(&rows, &events);
    let cycles = c.cycles.as_ref().unwrap();
    assert!(
        !cycles.drifts && cycles.of == "slip" && cycles.cycles == 8,
        "{cycles:?}"
    );
    assert_eq!(cycles.largest_position, 6);
    assert!((cycles.largest - 8.58e-3).abs() < 1e-7, "{cycles:?}");
    assert!(cycles.others < 1e-7, "{cycles:?}");
    events[11].0 += 9e-3;
    let c = judged_with_events(&rows, &events);
    let wrong = c.first_wrong.unwrap();
    assert_eq!((wrong.position, wrong.kind, wrong.fault), (6, "slip", None));
    assert!((wrong.error.unwrap() - 8.58e-3).abs() < 1e-7, "{wrong:?}");
    // A stiffer spring makes every cycle shorter by the same amount.
    let stiff = Solver {
        stiffness: 1.003,
        ..SOUND
    };
    assert!(rows_compared(&stiff.run().0, |_| {}).cycles.unwrap().drifts);
}

/// A run that conserves its energy balance shows no drift, however coarse its samples are and wherever events lie
/// between them. A run that gains energy does.
#[test]
fn property_a_drift_of_energy_is_above_what_the_samples_resolve() {
    for interval in [0.01, 0.015, 0.05, 0.2, 0.5] {
        let sampled = made("belt-leine", &[&format!("output.interval={interval}")]);
        let drift = belt().against(&sampled).energy_drift.unwrap();
        assert!(!drift.is_resolved(), "{interval}: {drift:?}");
    }
    let (mut rows, _) = SOUND.run();
    for [t, x, _] in &mut rows {
        *x *= if *t > 50.0 { 1.1 } else { 1.0 };
    }
    let drift = rows_compared(&rows, |_| {}).energy_drift.unwrap();
    assert!(drift.is_resolved(), "{drift:?}");
}

/// The stages follow each other, and the number of finished parts never decreases.
#[test]
fn property_a_comparison_says_how_far_it_is() {
    let belt = belt();
    let path = belt.path.with_file_name("mine.csv");
    let solver = Solver {
        stiffness: 1.003,
        ..SOUND
    };
    std::fs::write(&path, series("t,x,v", solver.run().0)).unwrap();
    let reference = Reference::open(&belt.path).unwrap();
    for quick in [false, true] {
        let mut mapping = reference.mapping();
        mapping.quick = quick;
        let mut said: Vec<CompareProgress> = Vec::new();
        let mut keep = |progress| said.push(progress);
        reference.compare_watched(&path, &mapping, &mut keep).unwrap();
        let number = |progress: &CompareProgress| match progress.stage {
            CompareStage::Events { .. } => 0,
            CompareStage::States { .. } => 1,
            CompareStage::Causes { .. } => 2,
        };
        assert!(
            said.windows(2)
                .all(|pair| number(&pair[0]) <= number(&pair[1]) && pair[0].done <= pair[1].done)
        );
        assert!(said.iter().all(|progress| (0.0..=1.0).contains(&progress.done)));
        assert_eq!(number(said.last().unwrap()), if quick { 1 } else { 2 });
    }
}

/// The run of a case, and the time and two of its columns as another solver would write them.
fn own_rows(case: &str, columns: [&str; 2]) -> (Kept, Vec<[f64; 3]>) {
    let kept = made(case, &[]);
    let columns = kept.columns(&columns);
    let rows = (0..columns[0].len()).map(|k| [columns[0][k], columns[1][k], columns[2][k]]);
    let rows = rows.collect();
    (kept, rows)
}

/// The solver gives its events, so their errors are those against the known solution.
#[test]
fn published_a_sound_solver_is_judged_by_its_true_error() {
    let (rows, events) = SOUND.run();
    let c = judged_with_events(&rows, &events);
    assert_eq!(causes(&c), [], "{}", c.verdict);
    assert_eq!((c.missing, c.spurious, c.reference_events), (0, 0, 16), "{}", c.verdict);
    // Slip and period as in the case belt-leine. The first slip begins at 5 s.
    let (slip, period) = (4.295_999_525_480_155, 12.001_031_294_830_579);
    let exact = |k: usize| 5.0 + period * (k / 2) as f64 + if k % 2 == 1 { slip } else { 0.0 };
    for (k, (time, _)) in events.iter().enumerate() {
        let error = c.event_errors.events[k].error;
        // The error of the reference itself.
        assert!((error - (time - exact(k))).abs() < 1e-10, "{k}: {error:e}");
    }
    assert!(c.event_errors.max.unwrap() < 1e-7, "{}", c.verdict);
    let drift = c.cycles.as_ref().unwrap();
    assert!(drift.per_cycle.abs() < 1e-8 && drift.cycles == 8, "{drift:?}");
    let [ours, theirs] = c.attractors.unwrap().map(Option::unwrap);
    assert_eq!((ours.sticks, theirs.sticks), (1, 1));
    assert!((theirs.period - period).abs() < 1e-8 && (theirs.amplitude.unwrap() - 0.844688683252).abs() < 1e-8);
    // A step of 0.01 errs by 1e-10 in the states at the end of a slip.
    let channels = c.channels.iter();
    let fewest = channels.filter_map(|row| row.scd).min_by(f64::total_cmp).unwrap();
    assert!(fewest > 7.0, "{fewest}");
    // Between samples of 0.01 s, the time of a stop is known to about 1e-4 s. The power of the belt jumps there by 0.3
    // W, which gives 3e-5 J for each of 16 events.
    assert!(c.energy_drift.unwrap().max < 1e-3, "{:?}", c.energy_drift);
}

#[test]
fn property_regularised_friction_is_recognised_with_its_speed() {
    let functions: [(Smooth, &str); 3] = [
        (f64::tanh, "tanh"),
        (|v| std::f64::consts::FRAC_2_PI * v.atan(), "arctan"),
        (|v| v.clamp(-1.0, 1.0), "up to 1"),
    ];
    for (smooth, name) in functions {
        let solver = Solver {
            smooth: Some((smooth, 1e-3)),
            step: 1e-3,
            ..SOUND
        };
        let c = judge(solver);
        evidence(&c, CauseKind::RegularisedLaw, &[name, "eps = 1.0"]);
    }
}

/// A threshold makes its sticks count. The period is that of the regularised law.
#[test]
fn published_a_regularised_period_is_short_by_what_is_known() {
    let solver = Solver {
        smooth: Some((f64::tanh, 1e-3)),
        step: 1e-3,
        ..SOUND
    };
    let text = series("t,x,v", solver.run().0);
    let c = belt().compared(&text, |mapping| mapping.set_tolerance("10 mm/s").unwrap());
    assert!(c.missing == 0 && c.spurious <= 1, "{}", c.verdict);
    let cycles = c.cycles.as_ref().unwrap();
    // 11.90059994 s minus 12.00103129 s, to the error of the detection.
    assert!((cycles.per_cycle + 0.10043135).abs() < 1e-4, "{cycles:?}");
    let theirs = c.attractors.unwrap()[1].unwrap();
    assert!(
        // The ends of a single period are known to within a sample.
        (theirs.period - 11.90059994).abs() < 1e-3 && theirs.sticks == 1,
        "{theirs:?}"
    );
    evidence(&c, CauseKind::RegularisedLaw, &[]);
}

#[test]
fn property_a_regularised_reference_is_compared_by_its_threshold() {
    let reference = made("belt-leine-tanh", &[]);
    let solver = Solver {
        smooth: Some((f64::tanh, 1e-3)),
        step: 1e-3,
        ..SOUND
    };
    let c = rows_judged(&reference, &solver.run().0);
    agrees(&c);
    // Parabolas through samples of 1 ms. Near |w| = 10 mm/s, w changes over milliseconds.
    assert!(c.event_errors.max.unwrap() < 1e-4, "{}", c.verdict);
    assert!(c.cycles.unwrap().per_cycle.abs() < 1e-5);
}

/// The case of a result of this program tells its law.
#[test]
fn property_a_regularised_case_is_named_by_its_keys() {
    let c = belt().against(&made("belt-leine-arctan", &[]));
    assert_eq!(causes(&c).first(), Some(&CauseKind::RegularisedLaw), "{}", c.verdict);
    let keys: Vec<&str> = c.case_differences.iter().map(|d| d.key.as_str()).collect();
    assert!(keys.contains(&"friction.regularisation.speed"), "{keys:?}");
}

fn one_number(c: &Comparison) -> (&str, f64) {
    assert_eq!(causes(c).first(), Some(&CauseKind::AnotherParameter), "{}", c.verdict);
    let found = c.parameters.as_ref().unwrap();
    assert_eq!(found.numbers.len(), 1, "{}", c.verdict);
    (&found.numbers[0].path, found.numbers[0].value)
}

/// The solver errs by 1e-10 in a slip, and a stretch of five samples by (omega h)^7/118 of an oscillation, 1e-16.
#[test]
fn property_another_number_of_the_equations_is_named_with_its_value() {
    let stiff = judge(Solver {
        stiffness: 1.1,
        ..SOUND
    });
    let (path, value) = one_number(&stiff);
    assert_eq!(path, "stator.stiffness.0", "{}", stiff.verdict);
    assert!((value - 1.1).abs() < 1e-7, "{}", stiff.verdict);
    let rerun = stiff.parameters.as_ref().unwrap().rerun.unwrap();
    assert_eq!(rerun.after.unmatched, 0, "{rerun:?}");

    let reference = made("belt-leine", &["stator.damping=0.05"]);
    let c = rows_judged(&reference, &SOUND.run().0);
    let (path, value) = one_number(&c);
    assert_eq!(path, "stator.damping.0", "{}", c.verdict);
    assert!(value.abs() < 1e-7, "{}", c.verdict);
    let found = causes(&rows_judged(&reference, &Solver { damping: 0.05, ..SOUND }.run().0));
    assert_eq!(found, []);

    // The case has no such parameter: damping of the shaft to the ground acts like damping of the mass.
    let c = judge(Solver { damping: 0.05, ..SOUND });
    let (path, value) = one_number(&c);
    let or = &c.parameters.as_ref().unwrap().or;
    let paths: Vec<&str> = or.iter().map(|number| number.path.as_str()).chain([path]).collect();
    assert!(paths.contains(&"stator.damping.0"), "{}", c.verdict);
    assert!(paths.contains(&"stator.viscous.0"), "{}", c.verdict);
    assert!((value - 0.05).abs() < 1e-7, "{}", c.verdict);
}

#[test]
fn property_a_breakaway_at_the_limit_of_slip_is_named() {
    let reference = made("belt-leine", &["friction.breakaway=1.2"]);
    let c = rows_judged(&reference, &SOUND.run().0);
    evidence(
        &c,
        CauseKind::StickTest,
        &[" mu_0 F_n: that is the limit of slip, mu(0) = 1, and not mu_0 = 1.2"],
    );
    let sound = Solver {
        breakaway: 1.2,
        ..SOUND
    };
    let c = rows_judged(&reference, &sound.run().0);
    assert_eq!(causes(&c), [], "{}", c.verdict);
}

#[test]
fn property_events_at_the_ends_of_steps_are_named() {
    let c = judge(Solver {
        located: false,
        ..SOUND
    });
    evidence(&c, CauseKind::EventsLate, &[]);
    assert_eq!((c.missing, c.spurious), (0, 0), "{}", c.verdict);
    // Steps beyond the stop and beyond the limit make each cycle longer.
    assert!(c.cycles.unwrap().per_cycle.abs() > 1e-4);
}

/// The bounds extend from the guard of the reference to the time at which the solver switches.
#[test]
fn property_a_bound_hides_no_switch_at_the_end_of_a_step() {
    for located in [true, false] {
        let (rows, events) = Solver { located, ..SOUND }.run();
        let c = rows_judged(&belt(), &rows);
        assert_eq!((c.missing, c.spurious), (0, 0), "{}", c.verdict);
        for (found, (time, _)) in c.event_errors.events.iter().zip(&events) {
            let missed = (found.time + found.error - time).abs();
            // The method errs by 1e-10 in a slip.
            assert!(missed <= found.bound + 1e-9, "{located}: {found:?}, at {time:?}");
        }
        assert_eq!(c.agrees_to_resolution, located, "{}", c.verdict);
    }
}

#[test]
fn property_units_signs_and_offsets_are_named() {
    let rows = SOUND.run().0;
    let changed = |change: fn([f64; 3]) -> [f64; 3]| {
        let rows: Vec<[f64; 3]> = rows.iter().map(|&row| change(row)).collect();
        rows_judged(&belt(), &rows)
    };
    let late = changed(|[t, x, v]| [t + 0.5, x, v]);
    evidence(
        &late,
        CauseKind::TimeOffset,
        &[" s later: its times count from another start"],
    );
    let milliseconds = changed(|[t, x, v]| [1e3 * t, x, v]);
    evidence(&milliseconds, CauseKind::WrongUnits, &["time looks like ms"]);
    let millimetres = changed(|[t, x, v]| [t, 1e3 * x, v]);
    evidence(&millimetres, CauseKind::WrongUnits, &["phi1 looks like mm"]);
    // The program's relative velocity is that of the belt minus that of the block.
    let turned: Vec<[f64; 3]> = rows.iter().map(|&[t, x, v]| [t, x, v - SPEED]).collect();
    let turned = belt().compared(&series("t,x,relative_velocity", turned), |_| {});
    evidence(
        &turned,
        CauseKind::WrongUnits,
        &["relative_velocity has the opposite sign"],
    );
}

/// Rows of a drill string as from a plain solver: absolute angles and speeds.
fn absolute(drill_string: &Kept, factor: f64) -> String {
    let columns = drill_string.columns(&["phi2", "theta", "phi2_dot", "theta_dot"]);
    let mut text = "t,rotor_angle_0,rotor_angle_1,rotor_speed_0,rotor_speed_1\n".to_owned();
    for row in 0..columns[0].len() {
        let values: Vec<String> = columns
            .iter()
            .enumerate()
            .map(|(k, c)| format!("{:?}", c[row] * if k == 1 || k == 2 { factor } else { 1.0 }))
            .collect();
        writeln!(text, "{}", values.join(",")).unwrap();
    }
    text
}

#[test]
fn property_absolute_coordinates_become_the_channels() {
    let drill_string = made("drill-string", &[]);
    let c = drill_string.compared(&absolute(&drill_string, 1.0), |_| {});
    let names: Vec<&str> = c.channels.iter().map(|row| &*row.channel).collect();
    for name in ["relative_velocity", "rotor_twist", "rotor_twist_rate", "theta", "phi2"] {
        assert!(names.contains(&name), "{name} in {names:?}");
    }
    // Differences of angles up to 600 rad.
    let twist = c.channels.iter().find(|row| row.channel == "rotor_twist").unwrap();
    assert!(twist.max < 1e-11, "{twist:?}");
    assert_eq!(causes(&c), [], "{}", c.verdict);
    assert_eq!(c.missing, 0, "{}", c.verdict);
    let scale = c.time_scale.as_ref().unwrap();
    // 2 pi sqrt(374/473)
    assert!((scale.period - 5.587077).abs() < 1e-5, "{scale:?}");
    assert!(scale.of.contains("rotor"), "{scale:?}");
    let degrees = absolute(&drill_string, 180.0 / std::f64::consts::PI);
    let degrees = drill_string.compared(&degrees, |_| {});
    evidence(&degrees, CauseKind::WrongUnits, &["deg"]);
}

/// A motion that slips at once has no stick, although omega_r = 0 in its first sample.
#[test]
fn property_a_run_that_slips_from_rest_has_no_first_slip() {
    let (reference, rows) = own_rows("block", ["theta", "theta_dot"]);
    let c = rows_judged(&reference, &rows);
    agrees(&c);
}

/// The equations connect one sample with the next at any distance.
#[test]
fn property_a_sparse_reference_is_a_function_of_time() {
    for case in ["belt-leine", "groan", "block", "lugre-slider", "belt-leine-tanh"] {
        let dense = made(case, &["output.end_time=2"]);
        let c = made(case, &["output.end_time=2", "output.interval=0.8"]).against(&dense);
        let found = (c.samples_too_sparse, causes(&c).len());
        assert_eq!(found, (0, 0), "{case}: {}", c.verdict);
        let channels = c.channels.iter();
        let fewest = channels.filter_map(|row| row.mescd).min_by(f64::total_cmp).unwrap();
        // The errors of the runs themselves.
        assert!(c.samples > 100 && fewest > 8.5, "{case}: {fewest}");
    }
}

/// Every event of a sound solver except one slip and one stick in the middle, or with one of each added.
#[test]
fn property_a_cycle_left_out_in_the_middle_moves_no_later_event() {
    let (rows, events) = SOUND.run();
    let judge = |events: &[(f64, &str)]| judged_with_events(&rows, events);
    let mut without = events.clone();
    without.drain(6..8);
    let c = judge(&without);
    assert_eq!((c.missing, c.spurious), (2, 0), "{}", c.verdict);
    let positions: Vec<usize> = c.sequence.iter().map(|difference| difference.position).collect();
    assert_eq!(positions, [6, 7], "{}", c.verdict);
    assert!(c.event_errors.max.unwrap() < 1e-7, "{}", c.verdict);
    // Matched with the events of the next cycle, later events would err by 2.57 s. All errors are below 1e-7 s.
    assert!(c.cycles.unwrap().per_cycle.abs() < 1e-7);

    let mut with = events.clone();
    let stick = events[7].0;
    with.splice(8..8, [(stick + 2.0, "slip"), (stick + 2.5, "stick")]);
    let c = judge(&with);
    assert_eq!((c.missing, c.spurious), (0, 2), "{}", c.verdict);
    assert!(c.event_errors.max.unwrap() < 1e-7, "{}", c.verdict);
}

/// The spring is twisted at the start. phi_2 - phi_1 from positions equals the slip displacement of a file.
#[test]
fn property_a_slip_displacement_follows_from_a_position_that_starts_elsewhere() {
    for case in ["belt-coulomb", "den-hartog", "hairer"] {
        let (reference, rows) = own_rows(case, ["phi1", "phi1_dot"]);
        assert!(rows[0][1] > 0.01, "{case}");
        let c = rows_judged(&reference, &rows);
        let channels = c.channels.iter();
        let slip: Vec<_> = channels.filter(|row| row.channel == "slip_displacement").collect();
        // The rounding of positions of some metres, and between samples the error of the reference.
        for row in &slip {
            assert!(row.max < 1e-9, "{case}: {row:?}");
        }
        // For a system on the ground, the slip displacement is the position itself and is compared as the position.
        assert!(!slip.is_empty() || case != "belt-coulomb", "{case}");
    }
}

/// The reference has the regularised law, not the candidate.
#[test]
fn property_a_true_stick_is_not_called_regularised() {
    let (kept, belt) = (made("belt-leine-arctan", &[]), belt());
    let c = kept.against(&belt);
    assert!(!causes(&c).contains(&CauseKind::RegularisedLaw), "{}", c.verdict);
    assert!(causes(&c).contains(&CauseKind::AnotherCase), "{}", c.verdict);
    let mapping = Mapping {
        hysteresis: Some(3.0),
        ..Mapping::default()
    };
    let reference = Reference::open(&kept.path).unwrap();
    let refused = reference.compare(&belt.path, &mapping).unwrap_err().to_string();
    assert!(refused.contains("leave out --hysteresis"), "{refused}");
}

/// A clutch locks permanently.
#[test]
fn property_a_motion_without_cycles_has_a_final_stick() {
    let clutch = made("clutch", &[]);
    let c = clutch.against(&clutch);
    let mut statistics = c.statistics.iter();
    let last = statistics.find(|statistic| statistic.name == "final_stick").unwrap();
    assert!(last.reference.is_some() && last.error() == Some(0.0), "{last:?}");
    assert!(c.absent.iter().all(|absent| absent.what != "final_stick"));
}

/// The reference's own samples: two equal halves of a period (a block, Den Hartog), and short sticks on a belt.
#[test]
fn property_a_period_of_samples_is_that_of_the_reference() {
    for (case, [x, v]) in [
        ("block", ["theta", "theta_dot"]),
        ("belt-coulomb", ["phi1", "phi1_dot"]),
        ("den-hartog", ["phi1", "phi1_dot"]),
    ] {
        let (reference, rows) = own_rows(case, [x, v]);
        let c = rows_judged(&reference, &rows);
        let [ours, theirs] = c.attractors.unwrap().map(Option::unwrap);
        // Both ends are found within one sampling interval.
        let error = (theirs.period - ours.period).abs();
        assert!(error < 2.0 * c.interval.unwrap(), "{case}: {theirs:?} for {ours:?}");
        assert_eq!(theirs.sticks, ours.sticks, "{case}");
    }
}
