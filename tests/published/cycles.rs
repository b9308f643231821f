//! Periodic motions and their branches, compared with closed forms, published values, and values of an independent
//! code with at least 34 digits.

#![expect(
    clippy::excessive_precision,
    reason = "numbers stand as their source has them, with more digits than a double holds"
)]

use crate::common::cases::{self, parsed, source};
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use stickslip::Watch;
use stickslip::case::{Case, CaseSource, WrittenCase};
use stickslip::continuation::{Branch, Continuation, ContinuationStudy, EndReason, Explored, Special, Stored};
use stickslip::cycle::{
    Border, CycleSearch, CycleStability, EnclosedEvent, Family, From, MultiplierKind, Orbit, certify, find,
};
use stickslip::sweep::StudySource;
use stickslip_analysis::Error;

/// A mass on a spring under a harmonic force, on a belt or on the ground.
fn forced(belt: &str, damping: f64, force: f64, omega: f64, friction: &str) -> String {
    format!(
        "motion = 'translation'\n[rotor]\n{belt}\n[stator]\ninertia = 1.0\nstiffness = 1.0\ndamping = {damping:?}\nend = 'fixed'\n\
         torque = {{ profile = 'cosine', amplitude = {force:?}, angular_frequency = {omega:?} }}\n[contact]\nnormal_force = 1.0\n\
         [friction]\n{friction}\n[output]\nend_time = 300.0\n"
    )
}

/// The same on the ground with Coulomb friction: coefficients of breakaway and of sliding.
fn on_the_ground(damping: f64, force: f64, omega: f64, (breakaway, kinetic): (f64, f64)) -> String {
    let law = format!("law = 'coulomb'\nbreakaway = {breakaway:?}\nkinetic = {kinetic:?}");
    forced("end = 'fixed'", damping, force, omega, &law)
}

/// Oscillator of di Bernardo, Kowalczyk and Nordmark, Sliding bifurcations: a novel mechanism for the sudden onset of
/// chaos in dry friction oscillators, International Journal of Bifurcation and Chaos 13 (2003) 2935.
fn driven_on_a_belt(omega: f64) -> String {
    let law = "law = 'polynomial'\nbreakaway = 1.5\nlow_speed = 1.5\nlinear = -1.5\nquadratic = 0.0\ncubic = 0.45\nvalid_below = 20.0";
    forced("end = 'driven'\nspeed = 1.0", 0.0, 0.1, omega, law)
}

/// A mass on a belt with a Stribeck law that rises again.
const STRIBECK: &str = "motion = 'translation'\n[rotor]\nend = 'driven'\nspeed = 0.3\n[stator]\ninertia = 1.0\nstiffness = 1.0\n\
                        damping = 0.03\nend = 'fixed'\n[contact]\nnormal_force = 1.0\n[friction]\nlaw = 'stribeck'\nbreakaway = 0.3\n\
                        low_speed = 0.3\nhigh_speed = 0.25\nscale = 0.5\nexponent = 2\nviscous = 0.018\n[output]\nend_time = 400.0\n";

fn family(source: &CaseSource, settings: &[&str]) -> Family {
    Family::new(WrittenCase::read(source, &parsed(settings)).unwrap(), &[]).unwrap()
}

fn cycle_of(source: &CaseSource, settings: &[&str], search: &CycleSearch) -> Orbit {
    find(&family(source, settings), &[], search, &|| false).unwrap()
}

fn found(source: &CaseSource, settings: &[&str]) -> Orbit {
    cycle_of(source, settings, &CycleSearch::default())
}

fn built_in(name: &str) -> CaseSource {
    CaseSource::built_in(name).unwrap()
}

#[track_caller]
fn near(value: f64, expected: f64, relative: f64) {
    cases::near(value, expected, relative * expected.abs());
}

/// The free multipliers, largest first.
fn free(orbit: &Orbit) -> Vec<(f64, f64)> {
    let free = orbit.multipliers.iter().filter(|one| one.kind == MultiplierKind::Free);
    free.map(|one| (one.real, one.imaginary)).collect()
}

#[test]
fn analytic_leine_s_belt_has_its_period_and_a_multiplier_of_zero() {
    let orbit = found(&built_in("belt-leine"), &[]);
    near(orbit.period, 12.00103129483057865, 4e-16);
    near(orbit.position.1, 1.133944676441656840, 1e-15);
    let amplitude = 0.5 * (1.13394467644165684 + 0.55543269006023160632);
    near(orbit.amplitude, amplitude, 1e-14);
    let kinds: Vec<_> = orbit.multipliers.iter().map(|one| one.kind).collect();
    assert_eq!(kinds, [MultiplierKind::Along, MultiplierKind::Stick]);
    assert_eq!(orbit.stability, CycleStability::Stable);
    near(orbit.shortest_stick.unwrap(), 7.7050317693504237635, 1e-13);
}

/// Small maxima of the relative velocity, which bristles cause, are not turns. The period is that of a run.
#[test]
fn property_bristles_do_not_hide_the_return() {
    let orbit = found(&built_in("lugre-slider"), &[]);
    // As many digits as in the report of a run.
    near(orbit.period, 6.362719821066, 1e-12);
    assert_eq!(orbit.stability, CycleStability::Stable);
}

#[test]
fn property_a_motion_without_a_position_has_no_amplitude() {
    assert!(found(&built_in("block"), &[]).amplitude.is_nan());
}

#[test]
fn analytic_coulomb_oscillator_in_closed_form() {
    let text = on_the_ground(0.1, 1.5, 0.9, (1.1, 1.0));
    let orbit = found(&source(&text), &[]);
    near(orbit.amplitude, 2.420236350574373275776, 1e-14);
    let multipliers = free(&orbit);
    near(multipliers[0].0, 0.5693655370136599360085709, 1e-9);
    near(multipliers[1].0, 0.08723318751421357289310, 1e-8);
    let nearest = orbit.nearest.unwrap();
    assert_eq!(nearest.border, Border::Reversal);
    near(nearest.distance, 0.748919086052795381935982, 1e-12);
}

/// The distance at which a separation vanishes is measured by its negative force.
#[test]
fn analytic_a_separation_is_measured_by_the_force() {
    let force = "contact.normal_force={profile='cosine', mean=9.5, amplitude=10, angular_frequency=3}";
    let nearest = found(&built_in("belt-coulomb"), &[force]).nearest.unwrap();
    assert_eq!(nearest.border, Border::Separation);
    // The extremum is found where the rate is zero to rounding.
    near(nearest.distance, 0.5 / 19.5, 1e-12);
}

/// Den Hartog's motions without stops. The amplitudes are in the case file. With damping, and near the birth of a
/// stick, they follow his closed form.
#[test]
fn published_den_hartog_amplitudes_and_the_birth_of_a_stick() {
    for (beta, q, amplitude) in [
        (2.0, 0.3, 0.2976761849915291949),
        (0.8, 0.4, 2.501787881002204763),
        (1.5, 0.5, 0.5537749241945383235),
        (0.6, 0.3, 1.535601809280865189),
    ] {
        // From rest; friction damps the transient.
        let orbit = found(&source(&on_the_ground(0.0, 1.0, beta, (q, q))), &[]);
        near(orbit.amplitude, amplitude, 1e-11);
        // The two slips are equal: neither vanishes before the other.
        assert!(orbit.nearest.is_none_or(|nearest| nearest.border == Border::Reversal));
    }
    let text = on_the_ground(0.1 * 2.0, 1.0, 0.8, (0.6, 0.6));
    let study = "case = 'case.toml'\n[[axis]]\nkey = ['friction.kinetic', 'friction.breakaway']\nfrom = 0.6\nto = 0.7\n[branch]\ndirection = 'up'\n";
    let explored = explored(&text, study);
    let birth = special_points(&explored, Special::Border(Border::Reversal));
    near(birth[0].0, 0.65406263174059063322, 1e-10);
}

/// Two stops in a period: closed forms of the stuck position and of the multiplier.
#[test]
fn analytic_two_stops_a_period() {
    for (beta, damping, q, multiplier) in [
        (0.8, 0.0, 0.9, 0.129515591640702166),
        (0.8, 0.2, 0.8, 0.502217266241197081),
        (0.5, 0.2, 0.8, 0.204990087586162205),
    ] {
        let orbit = found(&source(&on_the_ground(damping, 1.0, beta, (q, q))), &[]);
        near(free(&orbit)[0].0, multiplier, 1e-8);
        assert_eq!(orbit.sticks, 2);
        assert_eq!(orbit.multipliers.last().unwrap().kind, MultiplierKind::Stick);
    }
}

/// Multipliers agree with central differences of the oracle's map over a period.
#[test]
fn multiprecision_multipliers_are_those_of_differences_of_the_oracle() {
    use num_rational::BigRational;
    use stickslip::oracle::{OracleOptions, run};
    let text = on_the_ground(0.1, 1.5, 0.9, (1.1, 1.0));
    let orbit = found(&source(&text), &[]);
    let case = orbit.case(&family(&source(&text), &[])).unwrap();
    let exact = Case::exact(&source(&case.resolved()), &[]).unwrap();
    let end = BigRational::from_float(orbit.period).unwrap();
    let h = BigRational::new(1.into(), num_bigint::BigInt::from(10).pow(12));
    let after = |k: usize, sign: i64| -> [f64; 2] {
        let mut system = exact.system.clone();
        let moved = &h * BigRational::from_integer(sign.into());
        match k {
            0 => system.initial.stator_twist[0] += moved,
            _ => system.initial.stator_speed[0] += moved,
        }
        let options = OracleOptions {
            digits: 40,
            end_time: end.clone(),
            sample_times: vec![end.clone()],
            ..OracleOptions::default()
        };
        let report = run(&system, &options, &mut |_| std::ops::ControlFlow::Continue(())).unwrap();
        let state = &report.samples[0].1;
        // Differences are doubles of the distance from the exact start.
        let from = |number: &stickslip::oracle::ExactDouble, value: f64| {
            let own = number.to_rational().unwrap() - BigRational::from_float(value).unwrap();
            let scaled = own / &h;
            stickslip::oracle::decimal(&scaled, 20).parse::<f64>().unwrap()
        };
        [
            from(&state.stator_twist[0], case.system.initial.stator_twist[0]),
            from(&state.stator_speed[0], case.system.initial.stator_speed[0]),
        ]
    };
    let column = |k: usize| {
        let (forth, back) = (after(k, 1), after(k, -1));
        [(forth[0] - back[0]) / 2.0, (forth[1] - back[1]) / 2.0]
    };
    let (a, b) = (column(0), column(1));
    let (trace, determinant) = (a[0] + b[1], a[0] * b[1] - a[1] * b[0]);
    let root = (trace * trace / 4.0 - determinant).sqrt();
    let multipliers = free(&orbit);
    near(multipliers[0].0, trace / 2.0 + root, 1e-8);
    near(multipliers[1].0, trace / 2.0 - root, 1e-8);
}

#[test]
fn multiprecision_cycles_are_certified_by_the_oracle() {
    for (name, settings, period, digits) in [
        ("belt-leine", &[] as &[&str], "12.001031294830578647", 60),
        ("belt-exponential", &[], "0.658854627094458685941", 20),
        ("block", &[], "6.283185307179586476925286766559", 20),
    ] {
        let source = built_in(name);
        let family = family(&source, settings);
        let orbit = find(&family, &[], &CycleSearch::default(), &|| false).unwrap();
        let exact = Case::exact(&source, &parsed(settings)).unwrap();
        let certificate = certify(&family, &orbit, &exact, digits, orbit.periods_before(), &()).unwrap();
        // The file of the cycle has its events at these times.
        let case = orbit.case(&family).unwrap();
        let mut kept = stickslip::record::MemoryRecorder::default();
        stickslip::Run::new(&case).record(&mut kept).start().unwrap();
        let own = kept.events.iter().filter(|event| event.kind.in_event_sequence());
        for (EnclosedEvent { kind, time }, event) in certificate.events.iter().zip(own) {
            assert_eq!(*kind, event.kind.name(), "{name}");
            let error = (time.value - event.time).abs();
            assert!(error < 1e-10, "{name}: {} and {}", time.decimal, event.time);
        }
        let known = period.len().min(certificate.period.decimal.len()) - 2;
        assert!(known >= 18, "{name}: {}", certificate.period.decimal);
        assert_eq!(certificate.period.decimal[..known], period[..known], "{name}");
        assert!(certificate.contraction < 1e-6);
        assert!(certificate.events.iter().all(|event| event.time.error < 1e-19));
        near(certificate.period.value, orbit.period, 1e-15);
    }
}

#[test]
fn property_a_case_without_a_cycle_says_why() {
    let stops = Family::new(WrittenCase::read(&built_in("paper"), &[]).unwrap(), &[]);
    let says = |error: Error, why: &str| assert!(error.message.contains(why), "{error}");
    says(stops.unwrap_err(), "nothing drives this system");
    let search = |case: &str, settings: &[&str]| {
        find(
            &family(&built_in(case), settings),
            &[],
            &CycleSearch::default(),
            &|| false,
        )
    };
    says(search("clutch", &[]).unwrap_err(), "the contact sticks from");
    let steady = search("belt-exponential", &["rotor.speed=1.0", "output.end_time=100"]);
    assert!(steady.is_err(), "{steady:?}");
    let initial = CycleSearch {
        from: From::Initial,
        ..CycleSearch::default()
    };
    let stopped = find(&family(&built_in("belt-leine"), &[]), &[], &initial, &|| true);
    assert!(stopped.unwrap_err().is_interrupted());
    // Fast belts damp every motion.
    let sliding = search("belt-exponential", &["rotor.speed=0.8"]);
    says(sliding.unwrap_err(), "the motion decays to steady sliding");
}

fn explored(case: &str, study: &str) -> Explored {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("case.toml"), case).unwrap();
    let path: PathBuf = folder.path().join("study.toml");
    std::fs::write(&path, study).unwrap();
    let study = ContinuationStudy::parse(StudySource::find(path.to_str().unwrap(), &[]).unwrap(), &[]).unwrap();
    let file = folder.path().join("study.h5");
    let report = Continuation::new(&study, &file).start().unwrap();
    let stored = Stored::read(&file).unwrap();
    let points = |branches: &[Branch]| branches.iter().map(|one| one.points.len()).sum::<usize>();
    assert_eq!(points(&stored.branches), points(&report.explored.branches));
    report.explored
}

fn special_points(explored: &Explored, special: Special) -> Vec<(f64, f64)> {
    let points = explored.branches.iter().flat_map(|branch| &branch.points);
    let kept = points.filter(|point| point.special == Some(special));
    kept.map(|point| (point.value, point.period)).collect()
}

/// Asserts that each expected value of the first parameter is found to the ten digits of a special point.
fn assert_special_points(explored: &Explored, special: Special, expected: &[f64]) {
    let found = special_points(explored, special);
    for expected in expected {
        let is_it = |point: &(f64, f64)| (point.0 / expected - 1.0).abs() < 1e-10;
        assert!(found.iter().any(is_it), "{special:?} at {expected}: {found:?}");
    }
}

/// The Hopf point has a closed form. Unstable slip cycles lie between it and the graze, where stick-slip cycles also
/// end.
#[test]
fn analytic_exponential_belt_from_its_hopf_point_to_the_graze() {
    let case = built_in("belt-exponential").text;
    let study = over("rotor.speed", 0.25, 1.0, "of = ['steady', 'cycle']");
    let explored = explored(&case, &study);
    let hopf = special_points(&explored, Special::Hopf);
    assert!(!hopf.is_empty());
    for (value, period) in &hopf {
        near(*value, 10f64.ln() / 5.0, 1e-12);
        near(*period, std::f64::consts::TAU / 10.0, 1e-12);
    }
    let graze = special_points(&explored, Special::Border(Border::Touch));
    assert_eq!(graze.len(), 1, "{graze:?}");
    near(graze[0].0, 0.7346403888831704046747, 1e-11);
    near(graze[0].1, 0.63040137310520261244, 1e-10);
    // Between both, an unstable cycle at 0.6 m/s has amplitude 0.0501 m and multiplier 1.4927501228788784728.
    let branches = explored.branches.iter().filter(|branch| !branch.steady);
    let cycles = branches.flat_map(|branch| &branch.points);
    let slips = cycles.filter(|point| point.sticks == 0 && point.special.is_none());
    let slips: Vec<_> = slips.collect();
    assert!(slips.iter().any(|point| point.value > 0.46 && point.value < 0.73));
    for point in &slips {
        assert!(point.value > 0.4605 && point.value < 0.73465);
        assert_eq!(point.stability, CycleStability::Unstable);
    }
}

#[test]
fn multiprecision_unstable_cycles_of_the_exponential_belt() {
    // At the largest position, where the mass is at rest.
    for (speed, largest, period, amplitude, multiplier) in [
        (
            0.5,
            0.048210843397187978695,
            0.6287088412229251977,
            0.02557353412307150631,
            1.1281068718477718163,
        ),
        (
            0.6,
            0.074205939607171986861,
            0.62953347935030078691,
            0.050104746359047572889,
            1.4927501228788784728,
        ),
        (
            0.7,
            0.093636407615575982705,
            0.63019756507428232106,
            0.068222066521048315825,
            1.926392884739667982,
        ),
    ] {
        let (speed, twist) = (
            format!("rotor.speed={speed}"),
            format!("initial.stator_twist={largest}"),
        );
        let settings = [&speed, &twist, "initial.stator_speed=0.0"];
        let search = CycleSearch {
            from: From::Initial,
            ..CycleSearch::default()
        };
        let orbit = cycle_of(&built_in("belt-exponential"), &settings, &search);
        near(orbit.period, period, 1e-13);
        near(orbit.amplitude, amplitude, 1e-12);
        near(free(&orbit)[0].0, multiplier, 1e-9);
        assert_eq!(orbit.stability, CycleStability::Unstable);
    }
}

/// The onset of chaos, published as 1.7077997 rad/s: the cycle of four periods grazes. Also the flip that bears it.
#[test]
fn published_sliding_bifurcations_of_the_driven_oscillator() {
    let explored = explored(
        &driven_on_a_belt(1.73),
        "case = 'case.toml'\n[set]\noutput.end_time = 1500.0\n[[axis]]\nkey = 'stator.torque.angular_frequency'\nfrom = 1.66\n\
         to = 1.75\n[branch]\nperiods = 2\n",
    );
    assert_special_points(&explored, Special::Flip, &[1.712981036226938974]);
    let graze = Special::Border(Border::Touch);
    assert_special_points(&explored, graze, &[1.707799714885060333, 1.667690998105967954]);
    // A branch of twice the period begins with its own period and with the squares of the flip's multipliers.
    let mut branches = explored.branches.iter();
    let doubled = branches.find(|branch| branch.multiple == Some(4)).unwrap();
    let (branch, point) = doubled.parent.unwrap();
    let parent = &explored.branches[branch].points[point];
    near(doubled.points[0].period, 2.0 * parent.period, 1e-15);
    // The multiplier is -1 within 1e-8, the bound of neutral multipliers.
    near(doubled.points[0].spectrum[0].0, 1.0, 1e-8);
    // As published, to the last digit.
    let grazes = special_points(&explored, graze);
    assert!(grazes.iter().any(|graze| (graze.0 - 1.7077997).abs() < 5e-8));
    assert_special_points(&explored, Special::Fold, &[1.683440572495729398]);
}

#[test]
fn multiprecision_fold_of_cycles_of_a_stribeck_belt() {
    let explored = explored(STRIBECK, &over("rotor.speed", 0.1, 0.7, "of = 'steady'"));
    let hopf = [0.1281470464342835018786, 0.6498581240542824170201];
    assert_special_points(&explored, Special::Hopf, &hopf);
    assert_special_points(&explored, Special::Fold, &[0.65552910037991793708]);
    let grazes = [0.13625536578851913192, 0.57920612967726124473];
    assert_special_points(&explored, Special::Border(Border::Touch), &grazes);
}

#[test]
fn multiprecision_torus_of_a_forced_belt() {
    let explored = explored(
        &built_in("belt-exponential").text,
        "case = 'case.toml'\n[set]\nrotor.speed = 0.6\ninitial.stator_speed = 0.0\noutput.end_time = 100.0\n\
         stator.torque = { profile = 'cosine', amplitude = 2.0, angular_frequency = 14.0 }\n[[axis]]\n\
         key = 'stator.torque.amplitude'\nfrom = 1.0\nto = 3.0\n[branch]\n",
    );
    let torus = special_points(&explored, Special::Torus);
    assert_eq!(torus.len(), 1, "{torus:?}");
    near(torus[0].0, 2.492679910954482739, 1e-10);
}

/// Hopf points have the closed form c = alpha (mu_s - mu_d) F_n exp(-alpha v). Grazes pass through their known point.
#[test]
fn analytic_curves_in_two_numbers() {
    let explored = explored(
        &built_in("belt-exponential").text,
        "case = 'case.toml'\n[[axis]]\nkey = 'rotor.speed'\nfrom = 0.3\nto = 1.0\n[[axis]]\nkey = 'stator.damping.0'\nfrom = 0.5\n\
         to = 2.0\n[branch]\nof = ['steady', 'cycle']\ndirection = 'up'\ncurves = ['hopf', 'touch']\nstep = 0.1\n",
    );
    let curve = |special: Special| explored.curves.iter().find(|curve| curve.special == special).unwrap();
    let hopf = curve(Special::Hopf);
    assert!(hopf.points.len() > 10);
    for point in &hopf.points {
        near(point.values[1], 10.0 * (-5.0 * point.values[0]).exp(), 1e-9);
    }
    let touch = curve(Special::Border(Border::Touch));
    assert!(touch.points.len() > 10);
    let at_one = touch
        .points
        .iter()
        .min_by(|a, b| (a.values[1] - 1.0).abs().total_cmp(&(b.values[1] - 1.0).abs()))
        .unwrap();
    near(at_one.values[0], 0.7346403888831704, 1e-9);
}

/// The contact opens where the amplitude of the force equals its mean.
#[test]
fn analytic_the_curve_of_the_loss_of_contact() {
    let text = "motion = 'translation'\n[rotor]\nend = 'driven'\nspeed = 5.0\n[stator]\ninertia = 1.0\nstiffness = 1.0\n\
                damping = 0.2\nend = 'fixed'\n[contact]\nnormal_force = { profile = 'cosine', mean = 1.0, amplitude = 0.8, \
                angular_frequency = 0.7 }\n[friction]\nlaw = 'coulomb'\nbreakaway = 0.6\nkinetic = 0.3\n[output]\nend_time = 300.0\n";
    let study = "case = 'case.toml'\n[[axis]]\nkey = 'contact.normal_force.amplitude'\nfrom = 0.8\nto = 1.2\n\
                 [[axis]]\nkey = 'contact.normal_force.mean'\nfrom = 0.9\nto = 1.1\n[branch]\ndirection = 'up'\nstep = 0.1\n\
                 curves = ['opening', 'flip']\n";
    let explored = explored(text, study);
    let opening = Special::Border(Border::Opening);
    // Special points are true to 1e-10. This one is known at the border itself.
    near(special_points(&explored, opening)[0].0, 1.0, 1e-11);
    let curve = &explored.curves[0];
    assert_eq!((explored.curves.len(), curve.special), (1, opening));
    assert!(curve.points.len() > 4);
    for point in &curve.points {
        near(point.values[0], point.values[1], 1e-10);
    }
    // A requested curve without any point gives a remark.
    let remarks = &explored.remarks;
    let says = |remark: &String| remark.contains("no curve of flip");
    assert!(remarks.iter().any(says), "{remarks:?}");
}

/// A mass on a belt under a harmonic normal force. `belt`, `mass` and `pressed` vary.
fn pressed(belt: f64, mass: &str, pressed: &str, friction: &str) -> String {
    format!(
        "motion = 'translation'\n[rotor]\nend = 'driven'\nspeed = {belt:?}\n[stator]\nend = 'fixed'\n{mass}\n[contact]\n\
         normal_force = {pressed}\n[friction]\n{friction}\n[initial]\nstator_speed = {belt:?}\n[output]\nend_time = 240.0\n"
    )
}

fn over(key: &str, from: f64, to: f64, branch: &str) -> String {
    format!("case = 'case.toml'\n[[axis]]\nkey = '{key}'\nfrom = {from:?}\nto = {to:?}\n[branch]\n{branch}\n")
}

fn ends(explored: &Explored) -> Vec<EndReason> {
    explored.branches.iter().map(|branch| branch.end).collect()
}

/// Folds of cycles whose stick ends through the force, with a mass whose k/m is rounded, and a branch along which a
/// zero eigenvalue is a rounding.
#[test]
fn multiprecision_folds_and_branches_of_sticks_that_end_by_a_signal() {
    let force = "{ profile = 'sine', mean = 3.5544, amplitude = 2.13264, angular_frequency = 15.252609016443493 }";
    let law = "law = 'hyperbolic'\nbreakaway = 0.8194\nlow_speed = 0.8127\nhigh_speed = 0.4101\nscale = 0.3119";
    let mass = "inertia = 0.6106\nstiffness = 165.4868\ndamping = 0.289502665569689";
    let study = over("stator.stiffness.0", 150.0, 413.717, "direction = 'up'");
    let folds = explored(&pressed(0.2669, mass, force, law), &study);
    assert_special_points(&folds, Special::Fold, &[224.3259846903, 213.659519527]);
    let force = "{ profile = 'sine', mean = 2.0, amplitude = 1.2, angular_frequency = 2.0 }";
    let law = "law = 'coulomb'\nbreakaway = 0.85\nkinetic = 0.6";
    let study = over("stator.damping.0", 0.04, 0.2, "");
    let count = |mass: f64| {
        let mass = format!("inertia = {mass:?}\nstiffness = 9.7\ndamping = 0.08");
        let explored = explored(&pressed(0.06, &mass, force, law), &study);
        assert_eq!(ends(&explored), [EndReason::Range; 2]);
        explored.points()
    };
    assert_eq!(count(0.65), count(1.0));
}

/// If the start of the period moves off an event, the branch keeps its direction, with a varying drive or none.
#[test]
fn property_a_branch_keeps_its_direction_where_its_start_moves() {
    let law = "law = 'coulomb'\nbreakaway = 1.1\nkinetic = 1.0";
    let forced = forced("end = 'fixed'", 0.1, 1.5, 1.0, law);
    let explored_forced = explored(&forced, &over("stator.torque.angular_frequency", 0.6, 1.75, ""));
    assert_eq!(ends(&explored_forced), [EndReason::Range; 2]);
    let last = explored_forced.branches[0].points.last().unwrap();
    near(last.spectrum[0].0, 0.002075792808, 1e-6);
    let mass = "inertia = [0.738, 1.298142, 1.2647844]\nstiffness = [6.7842, 18.55275174, 3.55017186]\n\
                damping = [0.6054876570968694, 0.7366968323897609, 0.6507175850820055]";
    let law = "law = 'exponential'\nbreakaway = 0.6517\nlow_speed = 0.6517\nhigh_speed = 0.3835\ndecay = 3.5348";
    let text = pressed(0.3701, mass, "5.4161", law);
    let text = text.replace("stator_speed = 0.3701", "stator_speed = [0.3701, 0.0, 0.0]");
    let study = over(
        "stator.stiffness.0",
        2.71368,
        16.9605,
        "of = 'steady'\ndirection = 'down'",
    );
    let explored = explored(&text, &study);
    assert!(explored.remarks.is_empty(), "{:?}", explored.remarks);
}

/// Cycles become small with the speed of the belt, without a Hopf point. Steady sliding on a slow belt comes to rest.
#[test]
fn property_cycles_shrink_to_steady_sliding_at_a_hopf_point_only() {
    let mass = "inertia = 0.538\nstiffness = 6957.0\ndamping = 5.746";
    let law = "law = 'stribeck'\nbreakaway = 6.0\nlow_speed = 6.0\nhigh_speed = 2.0\nscale = 0.1\nexponent = 1\nviscous = 0.2";
    let text = pressed(0.2, mass, "1.0", law).replace("240.0", "20.0");
    let branch = "of = ['steady', 'cycle']\ndirection = 'down'\npoints = 300";
    let explored = explored(&text, &over("rotor.speed", 0.0, 0.3, branch));
    assert_eq!(ends(&explored)[..2], [EndReason::Rest, EndReason::Points]);
    let cycles = &explored.branches[1].points;
    assert!(cycles.iter().all(|point| point.special.is_none()));
    let slow = cycles
        .iter()
        .min_by(|a, b| (a.value - 1e-3).abs().total_cmp(&(b.value - 1e-3).abs()))
        .unwrap();
    // The period is 0.077527481 s at 0.001 m/s and changes by 0.8 s per m/s.
    near(slow.period, 0.077527481 - 0.8 * (slow.value - 1e-3), 1e-3);
}

/// A slip that ends at rest only touches the belt, and the motion jumps: the border from the side of the stick.
#[test]
fn property_a_slip_that_only_touches_the_belt() {
    let force = "{ profile = 'sine', mean = 2.0, amplitude = 3.0, angular_frequency = 5.0 }";
    let mass = "inertia = 1.0\nstiffness = 20.0\ndamping = 0.8";
    let text = pressed(0.5, mass, force, "law = 'coulomb'\nbreakaway = 0.6\nkinetic = 0.4");
    let study = over("contact.normal_force.amplitude", 1.0, 6.0, "direction = 'down'");
    let explored = explored(&text, &study);
    assert_eq!(ends(&explored), [EndReason::Jump]);
    let touch = special_points(&explored, Special::Border(Border::Touch));
    // The distance of neighbouring cycles is linear and vanishes here.
    near(touch[0].0, 1.593503109992, 3e-12);
    let orbit = found(&source(&text), &["contact.normal_force.amplitude=1.5936"]);
    let nearest = orbit.nearest.unwrap();
    assert_eq!(nearest.border, Border::Graze);
    assert!(nearest.distance > 0.0 && nearest.distance < 1e-2, "{nearest:?}");
}

/// The flip at which the doubled cycles were born is found from their side.
#[test]
fn multiprecision_flip_from_the_doubled_side() {
    let text = driven_on_a_belt(2.6)
        .replace("amplitude = 0.1", "amplitude = 1.52127")
        .replace("300.0", "1500.0");
    let study = over("stator.torque.angular_frequency", 2.2, 3.0, "direction = 'up'");
    let explored = explored(&text, &study);
    assert_eq!(ends(&explored), [EndReason::Halved]);
    assert_special_points(&explored, Special::Flip, &[2.7587172466188]);
}

/// Variation of the frequency of one of several drives leaves no common period.
#[test]
fn property_a_number_that_parts_the_drives_is_refused() {
    let torque = |first: f64| {
        format!(
            "motion = 'translation'\n[rotor]\nend = 'fixed'\n[stator]\ninertia = 1.0\nstiffness = 1.0\ndamping = 0.2\n\
             end = 'fixed'\ntorque = {{ profile = 'sum', signals = [{{ profile = 'cosine', amplitude = {first:?}, \
             angular_frequency = 0.7 }}, {{ profile = 'cosine', amplitude = 0.5, angular_frequency = 1.4 }}] }}\n[contact]\n\
             normal_force = 1.0\n[friction]\nlaw = 'coulomb'\nbreakaway = 0.3\nkinetic = 0.3\n[output]\nend_time = 200.0\n"
        )
    };
    for (first, key) in [(1.0, "angular_frequency"), (0.0, "amplitude")] {
        let key = format!("stator.torque.signals.0.{key}");
        let written = WrittenCase::read(&source(&torque(first)), &[]).unwrap();
        let value = written.case().number(&key).unwrap();
        let family = Family::new(written, &[vec![key.clone()]]).unwrap();
        let found = find(&family, &[value * 1.001 + 1e-3], &CycleSearch::default(), &|| false);
        let text = found.unwrap_err().to_string();
        assert!(text.contains("another common period") && text.contains(&key), "{text}");
    }
}

#[test]
fn property_stable_points_of_a_branch_are_where_long_runs_end() {
    let text = built_in("belt-exponential").text;
    let explored = explored(&text, &over("rotor.speed", 0.15, 0.45, "of = 'cycle'"));
    let points = explored.branches.iter().flat_map(|branch| &branch.points);
    let stable = points.filter(|point| point.stability == CycleStability::Stable && point.special.is_none());
    let stable: Vec<_> = stable.collect();
    assert!(stable.len() > 10);
    for point in stable.iter().step_by(7) {
        let speed = format!("rotor.speed={:?}", point.value);
        let orbit = found(&source(&text), &[&speed, "output.end_time=60"]);
        near(orbit.period, point.period, 1e-11);
        near(orbit.amplitude, (point.position.1 - point.position.0) / 2.0, 1e-9);
    }
}

/// Stops a study after a number of points.
struct StopsAt(f64, AtomicBool);

impl Watch for StopsAt {
    fn stopped(&self) -> bool {
        self.1.load(Ordering::Relaxed)
    }

    fn at(&self, points: f64, _: f64, _: std::fmt::Arguments<'_>) -> std::ops::ControlFlow<()> {
        self.1.fetch_or(points >= self.0, Ordering::Relaxed);
        std::ops::ControlFlow::Continue(())
    }
}

#[test]
fn property_a_resumed_study_gives_the_same_branches() {
    let text = "case = 'belt-exponential'\n[[axis]]\nkey = 'rotor.speed'\nfrom = 0.25\nto = 0.8\n[branch]\nof = ['steady', 'cycle']\n";
    let study = ContinuationStudy::parse(StudySource::text("resumed", text), &[]).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    let whole = Continuation::new(&study, &path("whole.h5")).start().unwrap();
    let all = whole.explored.points();
    for after in [3, all / 2, all - 4] {
        let name = format!("cut-{after}.h5");
        let (file, cut) = (path(&name), StopsAt(after as f64, AtomicBool::new(false)));
        let cut = Continuation::new(&study, &file).watch(&cut).start().unwrap();
        assert!(cut.explored.interrupted && cut.explored.points() < all);
        let refused = Continuation::new(&study, &path(&name)).start();
        assert!(refused.is_err(), "a journal is there");
        Continuation::new(&study, &path(&name)).resume(true).start().unwrap();
        assert!(!path(&name).with_extension("journal").exists());
        let [one, other] = [name.as_str(), "whole.h5"].map(|name| Stored::read(&path(name)).unwrap());
        for (branch, (one, other)) in one.branches.iter().zip(&other.branches).enumerate() {
            for (point, (one, other)) in one.points.iter().zip(&other.points).enumerate() {
                let found = format!("{one:?}");
                assert_eq!(found, format!("{other:?}"), "{after}: branch {branch}, point {point}");
            }
            assert_eq!(one.points.len(), other.points.len());
        }
        assert_eq!(one.branches.len(), other.branches.len());
    }
}

#[test]
fn property_wrong_studies_are_refused_with_line_and_remedy() {
    let axis = |key: &str, range: &str| format!("[[axis]]\nkey = '{key}'\n{range}\n");
    let speed = |range: &str| axis("rotor.speed", range);
    let (low, high) = ("from = 0.1\nto = 2.0", "from = 1.0\nto = 2.0");
    for (text, said) in [
        (String::new(), "the parameter that varies"),
        (speed(high), "outside the range"),
        (axis("rotor.sped", low), "rotor.speed"),
        (speed("values = [0.1, 0.2]"), "over a range"),
        (speed(low) + "[branch]\ncurves = ['hopf']\n", "second [[axis]]"),
        (speed(low) + "[branch]\nof = 'cycels'\n", "\"cycle\""),
        (
            axis("initial.stator_speed.0", "from = 0.0\nto = 2.0"),
            "does not depend on it",
        ),
        (speed(low) + &speed(low), "name another one"),
        (speed("from = 0.3\nto = 0.3"), "let them differ"),
    ] {
        let text = format!("case = 'belt-exponential'\n{text}");
        let error = ContinuationStudy::parse(StudySource::text("wrong", &text), &[]).unwrap_err();
        assert!(error.to_string().contains(said), "{error}");
    }
    let paper = "case = 'paper'\n[[axis]]\nkey = 'friction.decay'\nfrom = 1.0\nto = 9.0\n";
    let study = ContinuationStudy::parse(StudySource::text("paper", paper), &[]).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("paper.h5");
    assert!(Continuation::new(&study, &file).start().is_err());
    let found = std::fs::read_dir(folder.path()).unwrap().count();
    assert_eq!(found, 0, "nothing is left behind");
}
