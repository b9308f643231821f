//! The boundary tracer against known lines: the loss of stability at standstill, and single runs.

use std::path::Path;
use stickslip::analysis::stability::growth::foreseen_exponent;
use stickslip::case::Override;
use stickslip::model::Parameters;
use stickslip::results::{StudyFile, schema};
use stickslip::sweep::{
    CurveBranch, Design, Study, StudySource, Sweep, SweepReport, quantity_index, run_point, without_a_file,
};

fn study(text: &str) -> Study {
    Study::parse(StudySource::text("boundary", text), &[]).unwrap()
}

fn run(study: &Study, path: &Path) -> SweepReport {
    Sweep::new(study, path).start().unwrap()
}

/// A light rotor that stops within milliseconds, so that runs are cheap; the other parameters are the paper's.
const LIGHT: &str = r#"
case = "paper"
[set]
perturbation = []
axial.damping = "20000 lbf s/in"
actuation.rise_time = 0
torsion.rotor_inertia = 0.002
initial.speed = 10
output.end_time = 0.01
"#;

/// The margin of steady sliding is a function of alpha, c_t and omega_r alone. If the friction force is constant, the
/// margin is lost before the stop exactly if it is negative at standstill, which is the linear limit in closed form.
#[test]
fn analytic_the_traced_loss_of_stability_is_the_linear_limit() {
    let folder = tempfile::tempdir().unwrap();
    let text = format!(
        "{LIGHT}\n[[axis]]\nkey = \"friction.decay\"\nfrom = 0.05\nto = 0.8\ncount = 5\nspacing = \"log\"\n\
         [[axis]]\nkey = \"torsion.damping\"\nfrom = 5\nto = 40\ncount = 4\n\
         [boundary]\ncriterion = \"instability_time > 0\"\nrefinements = 1\nwidth = 1e-6\n"
    );
    let study = study(&text);
    let report = run(&study, &folder.path().join("b.h5"));
    assert_eq!(report.failed, 0, "{:?}", report.failures);
    let found = report.boundaries.unwrap();
    assert_eq!(found.curves.len(), 1);
    let points = &found.curves[0].points;
    assert!(points.len() > 8, "{}", points.len());
    let case = study.case_at(&study_corner(&study)).unwrap();
    let p = &Parameters::of(&case.system).unwrap();
    let force = p.actuation.pieces().largest();
    let law = p.friction.law.as_exponential().unwrap();
    let slope = 2.0 * p.contact.radius * force * (law.low_speed - law.high_speed);
    for point in points {
        assert_eq!(point.branch, CurveBranch::Lower);
        // A millisecond before the stop the speed is about 1 rad/s, but the last instants count: the run sees the
        // margin change if this happens above the first oscillation of omega_r about its mean, some 0.1 rad/s.
        let [decay, damping] = point.middle();
        let ratio = damping / (slope * decay);
        assert!((ratio - 1.0).abs() < 0.05, "alpha {decay}, c_t {damping}: {ratio}");
    }
    // The line of the linear limit is the closed form to the rounding of the bisection.
    let limit = &found.linear_limit[0].points;
    assert!(limit.len() > 40);
    for [decay, damping] in limit {
        assert!((damping / (slope * decay) - 1.0).abs() < 1e-12, "{decay} {damping}");
    }
    let file = StudyFile::open(&folder.path().join("b.h5"), schema::SWEEP_FORMAT).unwrap();
    assert_eq!(file.numbers("boundary/friction_decay").unwrap().len(), points.len());
}

fn study_corner(study: &Study) -> Vec<stickslip::case::Setting> {
    study.axes.iter().map(|axis| axis.levels[0].clone()).collect()
}

/// Both ends of every bracket of a coarse critical curve, as single runs with a tolerance a hundred times tighter, are
/// on their side of the curve; and the file does not depend on the number of threads.
#[test]
fn regression_boundary_points_hold_for_single_runs_at_a_tighter_tolerance() {
    let folder = tempfile::tempdir().unwrap();
    let text = r#"
case = "paper"
set = { perturbation = [{ kind = "kick", time = "instability", relative_velocity = 1e-6 }] }
axis = [
    { key = "friction.decay", from = 1, to = 300, count = 4, spacing = "log" },
    { key = "torsion.damping", from = 10, to = 60, count = 3 },
]
boundary = { refinements = 0, width = 1e-3 }
"#;
    let [study, tight] = [&[][..], &[Override::parse("solver.rtol=1e-12").unwrap()]]
        .map(|settings| Study::parse(StudySource::text("boundary", text), settings).unwrap());
    let report = run(&study, &folder.path().join("c.h5"));
    let found = report.boundaries.unwrap();
    let Design::Boundary(spec) = &study.design else {
        panic!("a boundary")
    };
    let mut checked = 0;
    for curve in &found.curves {
        for point in &curve.points {
            for (place, met) in [(point.met, true), (point.unmet, false)] {
                let coordinates = place.map(stickslip::case::Setting::Number).to_vec();
                let point = stickslip::sweep::StudyPoint { number: 0, coordinates };
                let outcome = run_point(&tight, &point, &without_a_file, &|| false).unwrap().unwrap();
                assert_eq!(spec.criterion.is_met(&outcome), met, "{place:?}");
                checked += 1;
            }
        }
    }
    assert!(checked >= 10, "{checked}");
}

const SMOOTH: &str = r#"
case = "paper"
set = { perturbation = [], solver.method = "series" }
axis = [
    { key = "friction.decay", from = 2, to = 600, count = 5, spacing = "log" },
    { key = "torsion.damping", from = 20, to = 3000, count = 5, spacing = "log" },
]
"#;

fn growth(study: &Study, [decay, damping]: [f64; 2]) -> f64 {
    let case = study
        .case_at(&[decay, damping].map(stickslip::case::Setting::Number))
        .unwrap();
    foreseen_exponent(&case.system, case.output.end_time).expect("the force is at rest")
}

/// G computed without a run equals the run's G over the plane of the critical curve, up to the shift of the run's loss
/// of stability by its present state (1e-3 of G where steady sliding changes fastest).
#[test]
fn property_the_foreseen_growth_is_that_of_the_run() {
    let study = study(SMOOTH);
    let quantity = quantity_index("growth_exponent").unwrap();
    let mut unstable = 0;
    for number in 0..study.point_count().unwrap() {
        let point = study.point(number).unwrap();
        let outcome = run_point(&study, &point, &without_a_file, &|| false).unwrap().unwrap();
        let place = [&point.coordinates[0], &point.coordinates[1]].map(|value| value.as_number().unwrap());
        let (found, foreseen) = (outcome.value(quantity), growth(&study, place));
        unstable += usize::from(found > 0.0);
        let error = (foreseen - found).abs();
        assert!(error <= 2e-3 * found + 1e-6, "{place:?}: {foreseen} {found}");
    }
    assert!(unstable > 15, "{unstable}");
}

/// Contours of G are exact on the drawn lines.
#[test]
fn analytic_contours_of_growth_have_their_level() {
    let folder = tempfile::tempdir().unwrap();
    let text = format!(
        "{SMOOTH}\n[boundary]\ncriterion = \"growth_exponent > 1e9\"\nrefinements = 0\ngrowth_contours = [20, 80]\n"
    );
    let study = study(&text);
    let found = run(&study, &folder.path().join("g.h5")).boundaries.unwrap();
    assert!(found.curves.is_empty());
    let points: Vec<_> = found
        .growth
        .iter()
        .flat_map(|line| line.points.iter().map(|&point| (line.level, point)))
        .collect();
    assert!(points.len() > 40, "{}", points.len());
    for (level, point) in points {
        let growth = growth(&study, point);
        // Where the path leaves the slow manifold for rigid sliding, G jumps by some thousandths.
        assert!((growth / level - 1.0).abs() < 5e-3, "{point:?}: {growth} for {level}");
    }
}

/// The fold of the critical curve, from four cells, is the top of a scan along x by single runs: in y to the bracket's
/// width, in x within the range where the curve is lower by no more than that.
#[test]
fn regression_the_fold_is_the_top_of_a_scan_along_x() {
    let folder = tempfile::tempdir().unwrap();
    let text = r#"
case = "paper"
set = { solver.method = "series", perturbation = [{ kind = "kick", time = "instability", relative_velocity = 1e-6 }] }
axis = [
    { key = "friction.decay", from = 20, to = 90, count = 5, spacing = "log" },
    { key = "torsion.damping", from = 1200, to = 2500, count = 4 },
]
boundary = { refinements = 0, width = 1e-4 }
"#;
    let study = study(text);
    let found = run(&study, &folder.path().join("n.h5")).boundaries.unwrap();
    assert_eq!(found.curves.len(), 1);
    let points = found.curves[0].points.iter();
    let folds: Vec<_> = points.filter(|point| point.branch == CurveBranch::Fold).collect();
    let [fold] = folds[..] else { panic!("{folds:?}") };
    let [decay, damping] = fold.middle();
    let meets = |decay: f64, damping: f64| {
        let coordinates = [decay, damping].map(stickslip::case::Setting::Number).to_vec();
        let point = stickslip::sweep::StudyPoint { number: 0, coordinates };
        let outcome = run_point(&study, &point, &without_a_file, &|| false).unwrap().unwrap();
        outcome.value(quantity_index("stick_count").unwrap()) >= 2.0
    };
    // 1300 N m s/rad times the width, and the same again for the uncertainty of y on the flat top.
    let open = 2.0 * 1300.0 * 1e-4;
    assert!(meets(decay, fold.met[1]) && !meets(decay, fold.unmet[1]));
    for k in -20..=20 {
        let beside = decay * (0.01 * f64::from(k)).exp();
        assert!(!meets(beside, damping + open), "{beside} rises above {decay}");
    }
    // The fold is the top: 20 % to each side the curve is lower by far more.
    for beside in [decay / 1.2, decay * 1.2] {
        assert!(!meets(beside, damping - 10.0 * open), "{beside}");
    }
}

/// Where breakaway is below low_speed there is no case, and a boundary ends. None of its points is next to a failed
/// run, although the lattice has crossings all along this limit.
#[test]
fn analytic_a_boundary_ends_where_runs_fail() {
    let folder = tempfile::tempdir().unwrap();
    let text = r#"
case = "paper"
set = { solver.method = "series", perturbation = [{ kind = "kick", time = "instability", relative_velocity = 1e-6 }] }
axis = [
    { key = "friction.decay", from = 0.2, to = 20, count = 5, spacing = "log" },
    { key = "friction.low_speed", from = 0.5, to = 0.8, count = 4 },
]
boundary = { refinements = 1, width = 1e-3 }
"#;
    let study = study(text);
    let report = run(&study, &folder.path().join("f.h5"));
    assert!(report.failed > 10, "{}", report.failed);
    let curves = report.boundaries.unwrap().curves;
    let points: Vec<_> = curves.iter().flat_map(|curve| &curve.points).collect();
    // The lower branch, from low_speed = 0.5 up to the limit.
    let highest = points.iter().map(|point| point.middle()[1]).fold(0.0, f64::max);
    assert!(points.len() >= 2 && highest > 0.5, "{points:?}");
    for point in points {
        assert!(point.unmet[1] <= 0.6 && point.met[1] <= 0.6, "{point:?}");
    }
}
