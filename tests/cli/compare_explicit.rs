//! `stickslip compare` with histories of explicit finite-element codes, from the user's side.

use super::compare::{agrees, compared, with_reference};
use crate::common::cli::{Folder, says};
use crate::common::compare::{csv, paper, rows_of};
use crate::common::json::*;
use stickslip::results::ResultFile;

/// Time of the candidate's first sample, s: after the kick at 6.966 s, and before the first event.
const START: f64 = 6.9665;

/// The reference's times (s), speeds of rotor and stator surface (rad/s), contact force (N) and friction torque (N
/// m).
fn history() -> Vec<[f64; 5]> {
    let file = ResultFile::open(paper()).unwrap();
    let all = 0..file.sample_count().unwrap();
    let [force, torque] = ["normal_force", "friction_torque"].map(|name| file.column(name, all.clone()).unwrap());
    let samples = file.samples(all).unwrap();
    let row = |(k, s): (usize, &stickslip::record::Sample)| {
        // In stick both speeds must be the same double.
        let phi2_dot = s.state.phi1_dot + s.state.relative_velocity;
        [s.time, phi2_dot, s.state.phi1_dot, force[k], torque[k]]
    };
    let rows = samples.iter().enumerate().map(row);
    // Dense samples alone, from which impulses can be computed.
    rows.filter(|row| (START..=6.99).contains(&row[0])).collect()
}

fn refused(folder: &Folder, arguments: &[&str]) -> String {
    let mut all = vec!["compare", "paper.h5"];
    all.extend(arguments);
    folder.refused(&all, "")
}

/// In stick, 32-bit speeds of some rad/s differ in their last digits, by 1e-7 rad/s.
const TOLERANCE: [&str; 2] = ["--velocity-tolerance", "1e-6"];

/// The history of a run as CSV with 32-bit numbers. Impulses replace forces, and times count from `origin` (s).
fn history_csv(rows: &[[f64; 5]], origin: f64) -> String {
    let mut text = "time,rotor VRZ,stator VRZ,lining FNZ,lining MZ\n".to_owned();
    let (mut normal, mut friction) = (0.0, 0.0);
    let mut before: Option<&[f64; 5]> = None;
    for row in rows {
        if let Some(b) = before {
            let half = 0.5 * (row[0] - b[0]);
            normal += half * (row[3] + b[3]);
            friction += half * (row[4] + b[4]);
        }
        let values = [row[0] - origin, row[1], row[2], normal, -friction];
        let values = values.map(|value| f64::from(value as f32).to_string());
        text += &format!("{}\n", values.join(","));
        before = Some(row);
    }
    text
}

const MAP: &str = "[channels]\nphi2_dot = \"rotor VRZ\"\nphi1_dot = \"stator VRZ\"\nnormal_impulse = \"lining FNZ\"\n\
                   friction_impulse = \"lining MZ\"\n";

#[test]
fn cli_a_history_of_impulses_in_32_bits() {
    let folder = with_reference();
    let rows = history();
    folder.write("brake.csv", history_csv(&rows, 0.0));
    folder.write("map.toml", MAP);
    let arguments = [&["brake.csv", "--map", "map.toml"][..], &TOLERANCE].concat();
    let c = compared(&folder, &arguments);
    agrees(&c);
    assert_eq!(c["format"], "CSV");
    // 32-bit numbers between 4 and 8 are 2^-21 apart. Each time is rounded by at most half of that.
    let resolution = &c["resolution"];
    assert_eq!(resolution["seconds"].as_f64(), Some(2f64.powi(-21)));
    assert_eq!(resolution["of"], "32-bit floating-point numbers");
    let below = resolution["events_below"].whole();
    assert!(below >= 90, "{resolution}");
    let max = c["event_errors"]["max"].number();
    assert!(max < 2.5e-6, "no further off than a sample: {max}");
    // Trapezia of 2.5 us. The contact force is constant. The friction torque jumps by up to 70 N m at 95 events, each
    // of which may be misplaced by half a step. This is 8e-3 N m s if all errors have the same sign, and about a
    // tenth of it otherwise.
    let impulses = c["impulses"].list();
    let of = |name: &str| impulses.with("channel", name);
    let (normal, friction) = (of("normal_impulse"), of("friction_impulse"));
    let found = (normal["unit"].as_str(), friction["unit"].as_str());
    assert_eq!(found, (Some("N s"), Some("N m s")));
    assert!(normal["reference"].number() > 50.0);
    // A time rounded by 2.4e-7 s gives an error of 5e-4 N s at 2225 N.
    assert!(normal["max"].number() < 2e-3, "{normal}");
    assert!(friction["reference"].number() > 0.3);
    assert!(friction["max"].number() < 2e-3, "{friction}");
    let found = (&normal["opposite"], &friction["opposite"]);
    assert_eq!(found, (&false.into(), &true.into()));

    // The resolution is reported first.
    let all = [&["compare", "paper.h5", "-v"][..], &arguments].concat();
    let stdout = folder.ok(&all);
    let paragraph = stdout.split("\n\n").nth(1).unwrap();
    assert!(
        paragraph.starts_with("its times are 32-bit floating-point numbers, 4.8e-7 s apart at 6.989"),
        "{stdout}"
    );
    says(
        &stdout,
        "below the resolution of its file & friction_impulse has the opposite sign",
    );
}

/// If the clock starts at the stick-slip, 32 bits resolve it.
#[test]
fn cli_a_clock_that_starts_elsewhere() {
    let folder = with_reference();
    let rows = history();
    folder.write("brake.csv", history_csv(&rows, START));
    folder.write("map.toml", MAP);
    let arguments = [&["brake.csv", "--map", "map.toml"][..], &TOLERANCE].concat();
    let c = compared(&folder, &arguments);
    let (verdict, offset) = (c["verdict"].as_str().unwrap(), &c["found_time_offset"]);
    says(verdict, &["its clock starts elsewhere: with 6.96649"]);
    let found = (&c["causes"][0]["cause"], &offset["agree"]);
    assert_eq!(found, (&"time-offset".into(), &95.into()));
    assert!((offset["seconds"].number() - START).abs() < 1e-7, "{offset}");

    for given in ["auto", "6.9665", "6966.5 ms"] {
        let all = [&arguments[..], &["--time-offset", given, "--quick"]].concat();
        let c = compared(&folder, &all);
        agrees(&c);
        assert!((c["time_offset"].number() - START).abs() < 1e-7);
        // Times near 0.023 s are 2^-29 apart.
        assert_eq!(c["resolution"]["seconds"].as_f64(), Some(2f64.powi(-29)));
        let max = c["event_errors"]["max"].number();
        // A sample within the tolerance can be up to 2e-7 s after a breakaway.
        assert!(max < 5e-7, "{given}: {max}");
    }
    folder.write("offset.toml", format!("time_offset = \"auto\"\n{MAP}"));
    agrees(&compared(
        &folder,
        &[&["brake.csv", "--map", "offset.toml", "--quick"][..], &TOLERANCE].concat(),
    ));
    let why = refused(&folder, &[&arguments[..], &["--time-offset", "yesterday"]].concat());
    assert!(why.contains("--time-offset"), "{why}");
}

/// The output of OpenRadioss's th_to_csv: names in quotes, padded with blanks, and numbers in `%e`.
#[test]
fn cli_a_time_history_that_was_converted_to_csv() {
    let folder = with_reference();
    let name = |id: u32, title: &str| format!("\"{:100} {id} {title:100}  {:10} \"", "surfaces", "VRZ");
    let mut text = format!(
        "\"time\",\"INTERNAL ENERGY\",{},{}\n",
        name(11, "rotor"),
        name(12, "stator")
    );
    let exponent = |value: f64| {
        let text = format!("{value:.6e}");
        let (mantissa, exponent) = text.split_once('e').unwrap();
        let exponent: i32 = exponent.parse().unwrap();
        format!("{mantissa}e{exponent:+03}")
    };
    for row in history() {
        let values = [row[0], 0.0, row[1], row[2]].map(exponent);
        text += &format!("{}\n", values.join(","));
    }
    folder.write("brakeT01.csv", text);
    let c = compared(
        &folder,
        &[
            "brakeT01.csv",
            "--column",
            "phi2_dot=surfaces 11 rotor VRZ",
            "--column",
            "phi1_dot=surfaces 12 stator VRZ",
            "--velocity-tolerance",
            "1e-5",
        ],
    );
    agrees(&c);
    assert_eq!(c["resolution"]["of"], "numbers of 7 digits");
    assert!((c["resolution"]["seconds"].number() / 1e-6 - 1.0).abs() < 1e-12);
}

#[test]
fn cli_few_digits_are_called_so() {
    let folder = with_reference();
    let rows = rows_of(paper(), 6.966);
    // Times with six digits are 1e-5 s apart, so that four samples of 2.5 us share each time.
    let text = csv(&rows);
    let mut few = String::new();
    for (k, line) in text.lines().enumerate() {
        let (time, rest) = line.split_once(',').unwrap();
        match time.parse::<f64>() {
            Ok(time) if k > 0 => few += &format!("{time:.5},{rest}\n"),
            _ => few += &format!("{line}\n"),
        }
    }
    folder.write("few.csv", few);
    let stdout = folder.ok("compare paper.h5 few.csv");
    let paragraph = stdout.split("\n\n").nth(1).unwrap();
    assert!(
        paragraph.starts_with("its times are numbers with 5 decimals, 1.0e-5 s apart"),
        "{stdout}"
    );
    assert!(
        paragraph.contains("rows have the time of the one before and are left out: write more digits"),
        "{stdout}"
    );
    // With all digits there is nothing to report.
    folder.write("all.csv", &text);
    assert!(compared(&folder, &["all.csv"])["resolution"].is_null());
}

/// Formats of finite-element codes are recognised by their first bytes or their names. The error says how to make CSV
/// of them.
#[test]
fn cli_histories_that_have_to_be_converted() {
    let folder = with_reference();
    let mut t01 = 84_u32.to_be_bytes().to_vec();
    t01.extend(4021_u32.to_be_bytes());
    folder.write("brakeT01", t01);
    folder.write("binout0000", [8, 8, 8, 1, 1, 1, 0, 0]);
    folder.write("single", [8, 8, 8, 1, 1, 0, 0, 0]);
    folder.write("binout0001", [4, 4, 4, 1, 1, 1, 0, 0]);
    folder.write(
        "abaqus.rpt",
        "\n                 X               VR3 rotor\n\n   0.   1.5E-03\n",
    );
    for (file, format, command) in [
        ("brakeT01", "OpenRadioss", "th_to_csv FILE"),
        ("binout0000", "LS-DYNA", "to_csv(\"binout.csv\")"),
        ("single", "LS-DYNA", "from lasso.dyna import Binout"),
        ("binout0001", "LS-DYNA", "Binout(\"binout*\")"),
        ("abaqus.rpt", "Abaqus", "awk -v OFS=, "),
    ] {
        let why = refused(&folder, &[file]);
        says(&why, &[file, format, "does not read", "convert it to CSV", command]);
    }
    // Names alone do not decide.
    let text = "X time relative_velocity\n1 6.967 0.5\n2 6.968 0.5\n";
    for file in ["binout.csv", "x.csv"] {
        folder.write(file, text);
        assert_eq!(compared(&folder, &[file])["format"], "CSV");
    }
}

/// The friction law of `paper` in the notation of the three codes, as in the manual.
#[test]
fn case_the_friction_of_the_paper_in_other_words() {
    use stickslip::friction::{FrictionLaw, Law};
    let p = crate::common::compare::parameters();
    let FrictionLaw::Exponential(law) = &p.friction.law else {
        panic!("the paper's law is exponential");
    };
    let manual = std::fs::read_to_string("docs/reference/compare.md").unwrap();
    let of = |row: &str| {
        let line = manual
            .lines()
            .find(|line| line.starts_with(&format!("|`{row}`")))
            .unwrap();
        line.trim_end_matches([' ', '|'])
            .rsplit('|')
            .next()
            .unwrap()
            .trim()
            .to_owned()
    };
    let rate = law.decay / p.contact.radius;
    assert_eq!(of("decay"), format!("{rate:.4} s/m, or {:.7} s/mm", rate / 1e3));
    assert_eq!(of("contact.radius"), format!("{:.7} m", p.contact.radius));
    let found = (of("low_speed"), of("high_speed"));
    assert_eq!(found, (law.low_speed.to_string(), law.high_speed.to_string()));
    assert_eq!(of("breakaway"), p.friction.breakaway.to_string());
    // The friction at the same motion is the same in each notation.
    for omega in [0.01, 0.3, 2.0, 50.0] {
        let slip_rate: f64 = omega * p.contact.radius;
        let other = law.high_speed + (law.low_speed - law.high_speed) * (-rate * slip_rate).exp();
        assert!((other - p.friction.law.coefficient(omega)).abs() < 1e-15);
    }
}
