//! Warnings of a run, as values that a program can match.

use crate::common::cases::built_in;
use crate::common::{disks, run};
use stickslip::analysis::Summary;
use stickslip::analysis::warning::{BalanceRemedy, Warning, finer, warnings};
use stickslip::case::Case;
use stickslip::simulation::{Method, SolverOptions};

fn warned(case: &str, settings: &[&str]) -> Vec<Warning> {
    let case = built_in(case, settings);
    let (_, report) = run(&disks(&case), &case.solver, &case.output);
    let summary = Summary::of_run(&case.system, &report);
    warnings(&case, &summary)
}

const SHORT: &str = "output={end_time=0.05, interval=0.01}";

#[test]
fn property_each_kind_of_warning_is_a_value() {
    assert_eq!(warned("paper-si", &[]), []);
    let found = warned("paper-si", &[SHORT]);
    assert_eq!(found, [Warning::KicksAfterTheEnd { count: 1, end: 0.05 }]);
    let expected = [Warning::KicksWithoutInstability {
        count: 1,
        end: 0.05,
        stuck: false,
    }];
    assert_eq!(warned("release", &[SHORT]), expected);
    assert!(warned("paper-si", &[SHORT, "solver.method=\"paper\""]).contains(&Warning::EventsNotLocated));
    let noise = warned("unperturbed", &[]);
    let [
        Warning::NoiseDetermined {
            instability,
            growth_to_onset,
            growth_exponent,
            perturbed,
        },
    ] = noise[..]
    else {
        panic!("{noise:?}")
    };
    assert!((6.95..6.96).contains(&instability) && !perturbed);
    assert!(growth_to_onset > 25.0 && growth_to_onset < growth_exponent);
    let loose = warned("paper", &["solver.method=\"cvode-bdf\"", "solver.rtol=0.1"]);
    let open = loose
        .iter()
        .find(|warning| matches!(warning, Warning::OpenBalance { .. }));
    let Some(Warning::OpenBalance {
        residual,
        turnover,
        remedy,
    }) = open
    else {
        panic!("{loose:?}")
    };
    assert!(*residual > 1e-6 * turnover);
    assert!(matches!(remedy, BalanceRemedy::Tolerances(solver) if solver.rtol == 0.1));
    let sudden = warned("paper-si", &[SHORT, "actuation.rise_time=1e-12"]);
    let slower = |warning: &Warning| matches!(warning, Warning::OpenBalance { remedy: BalanceRemedy::SlowerForce { change, .. }, .. } if *change == 1e-12);
    assert!(sudden.iter().any(slower), "{sudden:?}");
}

/// Scripts may search for these words.
#[test]
fn regression_warnings_read_as_they_always_did() {
    let texts = [
        (
            Warning::KicksAfterTheEnd { count: 1, end: 0.05 },
            "1 of the kicks never came: the run ended at t = 0.05 s, before its time; set a later output.end_time, or an \
             earlier time of the kick",
        ),
        (
            Warning::KicksAfterTheEnd { count: 2, end: 5.0 },
            "2 of the kicks never came: the run ended at t = 5 s, before their time; set a later output.end_time, or an \
             earlier time of the kick",
        ),
        (
            Warning::KicksWithoutInstability {
                count: 1,
                end: 10.0,
                stuck: true,
            },
            "1 of the kicks set at the instability never came: steady sliding did not lose its stability before the first \
             stick",
        ),
        (
            Warning::NoiseDetermined {
                instability: 6.955013,
                growth_to_onset: 33.6,
                growth_exponent: 88.06,
                perturbed: false,
            },
            "this stick-slip is amplified rounding error, not a property of the model. Sliding loses stability at \
             t = 6.955013 s, and until the first stick whatever deviates from smooth sliding grows by e^34 (of the growth \
             exponent G = 88.1 up to where smooth sliding itself would stick); no perturbation is set, so the onset, the \
             counts and every event after it belong to this solver and this tolerance, and change with both. For a result \
             that converges set a perturbation well above rounding, such as --set \
             'perturbation=[{kind=\"kick\", time=\"instability\", relative_velocity=1e-4}]'",
        ),
    ];
    for (warning, text) in texts {
        assert_eq!(warning.to_string(), text);
    }
}

#[test]
fn property_advice_on_accuracy_fits_the_method() {
    let of = |method, rtol| {
        finer(&SolverOptions {
            method,
            rtol,
            ..SolverOptions::default()
        })
    };
    for method in Method::all().filter(|method| method.locates_events()) {
        assert!(of(method, 1e-6).contains("a smaller solver.rtol"), "{}", method.name());
        assert!(
            !of(method, 1e-13).contains("a smaller solver.rtol"),
            "{}",
            method.name()
        );
    }
    for method in [Method::Cvode, Method::Arkode, Method::Erk] {
        let advice = of(method, SolverOptions::default().rtol);
        assert!(advice.starts_with("Use solver.method = \"series\""), "{advice}");
    }
    assert!(of(Method::CvodeBdf, 1e-10).contains("a smaller solver.rtol"));
    assert!(of(Method::Series, 1e-10).contains("--oracle"));
    let fixed = SolverOptions {
        method: Method::Erk,
        fixed_step: Some(1e-6),
        ..SolverOptions::default()
    };
    assert!(finer(&fixed).contains("solver.fixed_step"));
    // For an open balance, the remedy takes back only what was set.
    let remedy = |atol_rate, rtol, method| {
        BalanceRemedy::Tolerances(SolverOptions {
            atol_rate,
            rtol,
            method,
            ..SolverOptions::default()
        })
        .to_string()
    };
    let found = remedy(None, 0.1, Method::CvodeBdf);
    assert_eq!(found, "Use a smaller solver.rtol, or use --method series");
    let expected = "Leave the solver's atol_ keys to their defaults, use a smaller solver.rtol, or use --method series";
    assert_eq!(remedy(Some(1.0), 1e-6, Method::Cvode), expected);
    assert_eq!(remedy(None, 1e-10, Method::Cvode), "Use --method series");
}

/// The limit of an open balance follows `rtol` if the method controls its error. This does not hold for a fixed step.
#[test]
fn property_an_open_balance_is_measured_by_the_tolerance() {
    let with = |settings: &[&str]| built_in("paper", settings);
    let loose = with(&["solver.method=\"cvode\"", "solver.rtol=1e-3"]);
    let (_, report) = run(&disks(&loose), &loose.solver, &loose.output);
    let summary = Summary::of_run(&loose.system, &report);
    // 4e-6 of the energy turnover.
    assert!(summary.energy_residual > 1e-6 * summary.energy_turnover);
    let open = |case: &Case| {
        let warnings = warnings(case, &summary);
        warnings
            .iter()
            .any(|warning| matches!(warning, Warning::OpenBalance { .. }))
    };
    assert!(!open(&loose));
    assert!(open(&with(&["solver.rtol=1e-7"])));
    let mut stepped = loose.clone();
    stepped.solver.method = Method::Erk;
    stepped.solver.fixed_step = Some(1e-5);
    assert!(open(&stepped));
    stepped.solver.fixed_step = None;
    assert!(!open(&stepped));
}
