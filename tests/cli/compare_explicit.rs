//! `stickslip compare` with the histories of explicit finite-element codes, as a user of one starts it.

use crate::common::cli::{Folder, json, refusal, says};
use crate::common::compare::{csv, paper, rows_of};
use crate::common::explicit::{Group, Lsda, t01_head, t01_state, xy_table};
use stickslip::results::ResultFile;

/// Where the samples begin that a candidate has, s: after the kick, at 6.966 s, and before the first event.
const START: f64 = 6.9665;

/// Times (s), speeds of rotor surface and stator surface (rad/s), contact force (N) and friction torque (N m) of the reference.
fn history() -> Vec<[f64; 5]> {
    let file = ResultFile::open(paper()).unwrap();
    let all = 0..file.sample_count().unwrap();
    let [force, torque] = ["normal_force", "friction_torque"].map(|name| file.column(name, all.clone()).unwrap());
    let samples = file.samples(all).unwrap();
    let row = |(k, s): (usize, &stickslip::record::Sample)| {
        // In stick the two are the same number.
        let phi2_dot = s.state.phi1_dot + s.state.relative_velocity;
        [s.time, phi2_dot, s.state.phi1_dot, force[k], torque[k]]
    };
    let rows = samples.iter().enumerate().map(row);
    // Dense samples alone, which the impulses of a candidate can be made of.
    rows.filter(|row| (START..=6.99).contains(&row[0])).collect()
}

fn with_reference() -> Folder {
    let folder = Folder::new();
    std::fs::copy(paper(), folder.path("paper.h5")).unwrap();
    folder
}

/// The one comparison that a command prints as JSON.
fn compared(folder: &Folder, arguments: &[&str]) -> serde_json::Value {
    let mut all = vec!["compare", "paper.h5", "--json"];
    all.extend(arguments);
    let stdout = folder.ok(&all);
    json(&stdout)["comparisons"][0].clone()
}

#[track_caller]
fn agrees(c: &serde_json::Value) {
    let verdict = &c["verdict"];
    assert_eq!((&c["missing"], &c["spurious"]), (&0.into(), &0.into()), "{verdict}");
    assert_eq!(c["event_errors"]["matched"], 95, "{verdict}");
}

fn refused(folder: &Folder, arguments: &[&str]) -> String {
    let mut all = vec!["compare", "paper.h5"];
    all.extend(arguments);
    refusal(&mut folder.stickslip(&all))
}

/// 32-bit speeds of some rad/s differ by their last digits, 1e-7 rad/s, from what they are in stick.
const TOLERANCE: [&str; 2] = ["--velocity-tolerance", "1e-6"];

const GROUPS: [(i32, &[i32]); 2] = [(103, &[9, 30]), (101, &[3, 24])];

fn groups() -> Vec<Group> {
    let members = [vec![(11, "rotor surface"), (12, "stator surface")], vec![(7, "")]];
    let titles = ["surfaces", "lining"];
    let groups = GROUPS.into_iter().zip(members).zip(titles);
    groups
        .map(|(((of, codes), members), title)| Group {
            of,
            title,
            members,
            codes: codes.to_vec(),
        })
        .collect()
}

/// The history of a run of OpenRadioss, its times counted from `origin` (s).
fn t01(rows: &[[f64; 5]], origin: f64) -> Vec<u8> {
    let mut file = t01_head(4021, &groups());
    let (mut normal, mut friction) = (0.0, 0.0);
    let mut before: Option<&[f64; 5]> = None;
    for row in rows {
        if let Some(b) = before {
            let half = 0.5 * (row[0] - b[0]);
            normal += half * (row[3] + b[3]);
            friction += half * (row[4] + b[4]);
        }
        let bodies = [0.0, row[1], 0.0, row[2]];
        t01_state(&mut file, row[0] - origin, &[&bodies, &[normal, -friction]]);
        before = Some(row);
    }
    file
}

const T01_MAP: &str = "[channels]\nphi2_dot = \"rbody/11/VRZ\"\nphi1_dot = \"stator surface/VRZ\"\nnormal_impulse = \
                       \"inter/7/FNZ\"\nfriction_impulse = \"MZ\"\n";

#[test]
fn cli_a_time_history_of_openradioss() {
    let folder = with_reference();
    let rows = history();
    folder.write("brakeT01", t01(&rows, 0.0));
    folder.write("map.toml", T01_MAP);
    let arguments = [&["brakeT01", "--map", "map.toml"][..], &TOLERANCE].concat();
    let c = compared(&folder, &arguments);
    agrees(&c);
    assert_eq!(c["format"], "OpenRadioss T01");
    // 32-bit numbers between 4 and 8 are 2^-21 apart, and every time is rounded by half of that at most.
    let resolution = &c["resolution"];
    assert_eq!(resolution["seconds"].as_f64(), Some(2f64.powi(-21)));
    assert_eq!(resolution["of"], "32-bit floating-point numbers");
    let below = resolution["events_below"].as_u64().unwrap();
    assert!(below >= 90, "{resolution}");
    let max = c["event_errors"]["max"].as_f64().unwrap();
    assert!(max < 2.5e-6, "no further off than a sample: {max}");
    // Trapezia of 2.5 us: the contact force is constant, the friction torque jumps by up to 70 N m at 95 events, each of which they may
    // place wrong by half a step: 8e-3 N m s if all erred the same way, and a tenth of that as they do not.
    let impulses = c["impulses"].as_array().unwrap();
    let of = |name: &str| impulses.iter().find(|i| i["channel"] == name).unwrap();
    let (normal, friction) = (of("normal_impulse"), of("friction_impulse"));
    assert_eq!(
        (normal["unit"].as_str(), friction["unit"].as_str()),
        (Some("N s"), Some("N m s"))
    );
    assert!(normal["reference"].as_f64().unwrap() > 50.0);
    // A time that is rounded by 2.4e-7 s errs by 5e-4 N s at 2225 N.
    assert!(normal["max"].as_f64().unwrap() < 2e-3, "{normal}");
    assert!(friction["reference"].as_f64().unwrap() > 0.3);
    assert!(friction["max"].as_f64().unwrap() < 2e-3, "{friction}");
    assert_eq!(
        (&normal["opposite"], &friction["opposite"]),
        (&false.into(), &true.into())
    );

    // What it resolves is said first.
    let all = [&["compare", "paper.h5"][..], &arguments].concat();
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

    // An impulse is no force, and a name has to be clear.
    let why = refused(&folder, &["brakeT01", "--column", "friction_torque=inter/7/MZ"]);
    assert!(why.contains("normal_impulse or friction_impulse"), "{why}");
    let why = refused(&folder, &["brakeT01", "--column", "phi1_dot=VRZ"]);
    assert!(why.contains("VRZ"), "{why}");
    let why = refused(&folder, &["brakeT01"]);
    assert!(why.contains("rbody/11/VRZ"), "{why}");
}

/// Where its clock starts at the stick-slip, 32 bits resolve it.
#[test]
fn cli_a_clock_that_starts_elsewhere() {
    let folder = with_reference();
    let rows = history();
    folder.write("brakeT01", t01(&rows, START));
    folder.write("map.toml", T01_MAP);
    let arguments = [&["brakeT01", "--map", "map.toml"][..], &TOLERANCE].concat();
    let c = compared(&folder, &arguments);
    let (verdict, offset) = (c["verdict"].as_str().unwrap(), &c["found_time_offset"]);
    says(verdict, &["its clock starts elsewhere: with 6.96649"]);
    assert_eq!(
        (&c["causes"][0]["cause"], &offset["agree"]),
        (&"time-offset".into(), &95.into())
    );
    assert!((offset["seconds"].as_f64().unwrap() - START).abs() < 1e-7, "{offset}");

    for given in ["auto", "6.9665", "6966.5 ms"] {
        let all = [&arguments[..], &["--time-offset", given, "--quick"]].concat();
        let c = compared(&folder, &all);
        agrees(&c);
        assert!((c["time_offset"].as_f64().unwrap() - START).abs() < 1e-7);
        // At 0.023 s they are 2^-29 apart.
        assert_eq!(c["resolution"]["seconds"].as_f64(), Some(2f64.powi(-29)));
        let max = c["event_errors"]["max"].as_f64().unwrap();
        // A sample that is still within the tolerance comes up to 2e-7 s after a breakaway.
        assert!(max < 5e-7, "{given}: {max}");
    }
    folder.write("offset.toml", format!("time_offset = \"auto\"\n{T01_MAP}"));
    agrees(&compared(
        &folder,
        &[&["brakeT01", "--map", "offset.toml", "--quick"][..], &TOLERANCE].concat(),
    ));
    let why = refused(&folder, &[&arguments[..], &["--time-offset", "yesterday"]].concat());
    assert!(why.contains("--time-offset"), "{why}");
}

#[test]
fn cli_a_damaged_time_history_is_refused_with_the_place() {
    let folder = with_reference();
    let rows = history();
    let whole = t01(&rows[..50], 0.0);
    let column = ["--column", "relative_velocity=11/VRZ"];
    let head = t01_head(4021, &groups()).len();
    // 2 markers of 4 bytes, 1 + 22 + 2 + 1 + 4 + 2 values of 4 bytes, in 6 records.
    let state = 6 * 8 + 4 * 32;
    assert_eq!(whole.len(), head + 50 * state);
    folder.write("cut", &whole[..head + 10 * state + 33]);
    let why = refused(&folder, &[&["cut"][..], &column].concat());
    let end = head + 10 * state;
    assert!(
        why.contains(&format!("byte {end}")) && why.contains(&format!("head -c {end}")),
        "{why}"
    );
    folder.write("short", &whole[..300]);
    let why = refused(&folder, &[&["short"][..], &column].concat());
    assert!(why.contains("byte"), "{why}");
    let mut other = whole.clone();
    other[head + 3 * state + 12] ^= 1;
    folder.write("other", other);
    let why = refused(&folder, &[&["other"][..], &column].concat());
    assert!(why.contains(&format!("byte {}", head + 3 * state + 12)), "{why}");
}

/// What th_to_csv of OpenRadioss makes: names in quotes, filled with blanks, and `%e`.
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
    assert!((c["resolution"]["seconds"].as_f64().unwrap() / 1e-6 - 1.0).abs() < 1e-12);
}

#[test]
fn cli_few_digits_are_called_so() {
    let folder = with_reference();
    let rows = rows_of(paper(), 6.966);
    // Times of six digits are 1e-5 s apart: four samples of 2.5 us share each.
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
    // With all digits there is nothing to say.
    folder.write("all.csv", &text);
    assert!(compared(&folder, &["all.csv"])["resolution"].is_null());
}

fn nodout(rows: &[[f64; 5]], kind: Lsda, first: u32) -> Vec<u8> {
    let state = |row: &[f64; 5]| (row[0], vec![("rz_velocity", vec![0.0, row[1], row[2]])]);
    let states: Vec<_> = rows.iter().map(state).collect();
    kind.file("nodout", &[5, 11, 12], &states, first)
}

#[test]
fn cli_binary_histories_of_ls_dyna() {
    let folder = with_reference();
    let rows = history();
    let columns = [
        "--column",
        "phi2_dot=nodout/11/rz_velocity",
        "--column",
        "phi1_dot=nodout/12/rz_velocity",
    ];
    for little in [true, false] {
        for double in [true, false] {
            let kind = Lsda { little, double };
            let run = format!("run{}{}", u8::from(little), u8::from(double));
            std::fs::create_dir(folder.path(&run)).unwrap();
            // A parallel run writes several files, and a long one continues them.
            let half = rows.len() / 2;
            folder.write(&format!("{run}/binout0000"), nodout(&rows[..half], kind, 1));
            folder.write(
                &format!("{run}/binout0000%001"),
                nodout(&rows[half..], kind, half as u32 + 1),
            );
            let force = |row: &[f64; 5]| (row[0], vec![("z_force", vec![row[3], -row[3]])]);
            let forces: Vec<_> = rows.iter().map(force).collect();
            folder.write(&format!("{run}/binout0003"), kind.file("rcforc", &[1, 1], &forces, 1));
            let file = format!("{run}/binout0000");
            let mut arguments = vec![file.as_str()];
            arguments.extend(columns);
            arguments.extend(["--column", "normal_force=rcforc/z_force[0]"]);
            arguments.extend(TOLERANCE);
            let c = compared(&folder, &arguments);
            agrees(&c);
            assert_eq!(c["format"], "LS-DYNA binout");
            let resolution = c["resolution"]["seconds"].as_f64();
            assert_eq!(resolution, (!double).then(|| 2f64.powi(-21)), "{little} {double}");
        }
    }
    let file = "run11/binout0000";
    let why = refused(&folder, &[file, "--column", "phi1_dot=rz_velocity"]);
    says(&why, &["nodout/ID/rz_velocity", "5, 11, 12"]);
    let why = refused(&folder, &[file]);
    assert!(why.contains("nodout/5/rz_velocity"), "{why}");
    let one = nodout(
        &rows[..20],
        Lsda {
            little: true,
            double: true,
        },
        1,
    );
    folder.write("cut", &one[..one.len() - 30]);
    let why = refused(&folder, &["cut", columns[0], columns[1]]);
    assert!(why.contains("byte"), "{why}");
    // Interfaces at another interval.
    std::fs::create_dir(folder.path("two")).unwrap();
    folder.write(
        "two/binout0000",
        nodout(
            &rows[..20],
            Lsda {
                little: true,
                double: true,
            },
            1,
        ),
    );
    let coarse: Vec<_> = rows[..20]
        .iter()
        .step_by(2)
        .map(|row| (row[0], vec![("z_force", vec![row[3]])]))
        .collect();
    folder.write(
        "two/binout0001",
        Lsda {
            little: true,
            double: true,
        }
        .file("rcforc", &[1], &coarse, 1),
    );
    let why = refused(
        &folder,
        &[
            "two/binout0000",
            columns[0],
            columns[1],
            columns[2],
            columns[3],
            "--column",
            "normal_force=z_force",
        ],
    );
    assert!(why.contains("in 10") && why.contains("one database"), "{why}");
}

#[test]
fn cli_xy_reports_of_abaqus() {
    let folder = with_reference();
    let rows = history();
    let names = ["VR3 rotor N1", "VR3 stator N2", "CFN3"];
    let row = |(k, row): (usize, &[f64; 5])| {
        // The contact force at every other sample.
        vec![
            Some(row[0]),
            Some(row[1]),
            Some(row[2]),
            k.is_multiple_of(2).then_some(row[3]),
        ]
    };
    let table: Vec<Vec<Option<f64>>> = rows.iter().enumerate().map(row).collect();
    let half = table.len() / 2;
    // Two pages, nine digits.
    let text = xy_table(&names, &table[..half], 9) + &xy_table(&names, &table[half..], 9);
    folder.write("abaqus.rpt", &text);
    let columns = [
        "--column",
        "phi2_dot=VR3 rotor N1",
        "--column",
        "phi1_dot=VR3 stator N2",
    ];
    let arguments = [&["abaqus.rpt"][..], &columns, &["--velocity-tolerance", "1e-7"]].concat();
    let c = compared(&folder, &arguments);
    agrees(&c);
    assert_eq!(c["format"], "Abaqus XY report");
    // Nine digits at 7 s: 1e-8 s, of which the step of 2.5 us is a multiple or nearly.
    let max = c["event_errors"]["max"].as_f64().unwrap();
    assert!(max < 5e-8, "{max}");
    // Five digits are too little for a clock that starts at 0, and resolve 1e-6 s of one that starts at the stick-slip.
    let from_start = |row: &Vec<Option<f64>>| {
        let mut row = row.clone();
        row[0] = row[0].map(|time| time - START);
        row
    };
    let late: Vec<Vec<Option<f64>>> = table.iter().map(from_start).collect();
    folder.write("five.rpt", xy_table(&names, &late, 5));
    let five = [
        &["five.rpt"][..],
        &columns,
        &["--velocity-tolerance", "1e-4", "--time-offset", "auto"],
    ]
    .concat();
    let c = compared(&folder, &five);
    assert_eq!(c["resolution"]["of"], "numbers of 5 digits");
    assert!((c["resolution"]["seconds"].as_f64().unwrap() / 1e-6 - 1.0).abs() < 1e-9);
    assert_eq!(
        (&c["missing"], &c["spurious"]),
        (&0.into(), &0.into()),
        "{}",
        c["verdict"]
    );

    // Two tables of the same times, side by side.
    let of = |columns: [usize; 2]| {
        table
            .iter()
            .map(|row| columns.map(|k| row[k]).to_vec())
            .collect::<Vec<_>>()
    };
    let apart = xy_table(&["w2"], &of([0, 1]), 9) + &xy_table(&["w1"], &of([0, 2]), 9);
    folder.write("apart.rpt", apart);
    agrees(&compared(
        &folder,
        &[
            "apart.rpt",
            "--column",
            "phi2_dot=w2",
            "--column",
            "phi1_dot=w1",
            "--velocity-tolerance",
            "1e-7",
        ],
    ));

    folder.write("twice.rpt", text.repeat(2));
    let why = refused(&folder, &[&["twice.rpt"][..], &columns].concat());
    assert!(why.contains("appendMode=OFF") && why.contains("line"), "{why}");
    folder.write(
        "field.rpt",
        "*****************\nField Output Report, written Wed Dec 10 19:12:19 2025\n\nSource 1\n",
    );
    let why = refused(&folder, &[&["field.rpt"][..], &columns].concat());
    assert!(why.contains("field output report"), "{why}");
    folder.write("torn.rpt", &text[..text.len() / 3]);
    let why = refused(&folder, &[&["torn.rpt"][..], &columns].concat());
    assert!(why.contains("line"), "{why}");
}

/// The friction of `paper` in the words of the three codes, as the manual has it.
#[test]
fn case_the_friction_of_the_paper_in_other_words() {
    use stickslip::friction::{FrictionLaw, Law};
    let p = crate::common::compare::parameters();
    let FrictionLaw::Exponential(law) = &p.friction.law else {
        panic!("the paper's law is exponential");
    };
    let manual = std::fs::read_to_string("docs/validate-your-solver.md").unwrap();
    let of = |row: &str| {
        let line = manual
            .lines()
            .find(|line| line.starts_with(&format!("| `{row}`")))
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
    assert_eq!(
        (of("low_speed"), of("high_speed")),
        (law.low_speed.to_string(), law.high_speed.to_string())
    );
    assert_eq!(of("breakaway"), p.friction.breakaway.to_string());
    // The same friction at the same motion, whichever way it is written.
    for omega in [0.01, 0.3, 2.0, 50.0] {
        let slip_rate: f64 = omega * p.contact.radius;
        let other = law.high_speed + (law.low_speed - law.high_speed) * (-rate * slip_rate).exp();
        assert!((other - p.friction.law.coefficient(omega)).abs() < 1e-15);
    }
}
