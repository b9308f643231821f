//! Messages about wrong cases: the file, the line, the key, what was expected, and what to do.

use std::path::PathBuf;

use stickslip::case::{Case, CaseSource, Origin};

/// A valid case in which every kind of value occurs. The tests change one thing at a time.
const VALID: &str = r#"title = "A brake"

[axial]
mass = 4.54
stiffness = "55.38 MN/m"
damping = 8760

[actuation]
profile = "ramp"
force = "500 lbf"
rise_time = 1.0

[torsion]
rotor_inertia = 2.262
surface_inertia = 0.0113
stiffness = 7.71e6
damping = "200 lbf in s/rad"

[contact]
radius = 0.052388
breakaway_test = "transmitted"

[friction]
breakaway = 0.6
low_speed = 0.6
high_speed = 0.3
decay = 3.5

[initial]
speed = 100

[[perturbation]]
kind = "kick"
time = 6.9697
relative_velocity = 1e-4

[solver]
method = "cvode"
rtol = 1e-10
max_events = 1000

[output]
end_time = 10
interval = 0.01
steps = false

[[output.window]]
from = 6.96
to = 6.992
interval = 1e-5
"#;

fn parse(text: &str) -> Result<Case, String> {
    let source = CaseSource {
        text: text.to_owned(),
        origin: Origin::File(PathBuf::from("brake.toml")),
    };
    Case::read(&source, &[]).map_err(|error| error.to_string())
}

/// The messages after `from` is replaced in the valid case.
fn with(from: &str, to: &str) -> String {
    assert_eq!(VALID.matches(from).count(), 1, "{from:?} must occur once");
    parse(&VALID.replace(from, to)).expect_err("the case must be refused")
}

/// Like `with`, for a change that leaves the case valid.
fn accepted(from: &str, to: &str) -> Case {
    assert_eq!(VALID.matches(from).count(), 1, "{from:?} must occur once");
    parse(&VALID.replace(from, to)).unwrap_or_else(|error| panic!("{error}"))
}

fn first_problem(text: &str) -> String {
    let problems = parse(text).unwrap_err();
    problems.lines().next().unwrap_or_default().to_owned()
}

#[test]
fn the_case_that_the_tests_break_is_valid() {
    parse(VALID).unwrap();
}

#[test]
fn a_syntax_error_names_its_line() {
    insta::assert_snapshot!(with("mass = 4.54", "mass = = 4.54"), @r#"brake.toml:4: not valid TOML: extra `=`, expected nothing"#);
    insta::assert_snapshot!(with("[torsion]", "[torsion"), @r#"brake.toml:13: not valid TOML: unclosed table, expected `]`"#);
    insta::assert_snapshot!(with("mass = 4.54", "mass = 4.54 kg"), @r#"brake.toml:4: not valid TOML: string values must be quoted, expected literal string"#);
}

#[test]
fn a_duplicate_key_or_table_names_its_line() {
    insta::assert_snapshot!(with("mass = 4.54", "mass = 4.54\nmass = 4.55"), @r#"brake.toml:5: not valid TOML: duplicate key mass"#);
    insta::assert_snapshot!(with("[initial]", "[axial]"), @r#"brake.toml:29: not valid TOML: duplicate key axial"#);
}

#[test]
fn line_numbers_count_windows_line_ends_and_a_byte_order_mark_alike() {
    let text = VALID.replace("rise_time = 1.0", "rise_time = -1.0");
    let plain = parse(&text).unwrap_err();
    assert_eq!(parse(&text.replace('\n', "\r\n")).unwrap_err(), plain);
    assert_eq!(parse(&format!("\u{feff}{text}")).unwrap_err(), plain);
    assert!(plain.starts_with("brake.toml:11: actuation.rise_time: "), "{plain}");
}

#[test]
fn an_unknown_key_is_answered_with_the_nearest_or_with_all() {
    insta::assert_snapshot!(with("mass = 4.54", "mas = 4.54"), @r#"
brake.toml:3: axial.mass: missing: m, the rotor mass; write mass = a number in kg or "10 lbm"
brake.toml:4: axial.mas: unknown key; did you mean axial.mass?
"#);
    insta::assert_snapshot!(with("[initial]", "[inital]"), @r#"
brake.toml:29: inital: unknown key; did you mean initial?
brake.toml: initial.speed: missing: omega_0, initial speed of the rotor and of its surface; write speed = a number in rad/s or "955 rpm"
"#);
    insta::assert_snapshot!(with("mass = 4.54", "mass = 4.54\nrotor_inertia = 2"), @r#"brake.toml:5: axial.rotor_inertia: unknown key; did you mean torsion.rotor_inertia?"#);
    insta::assert_snapshot!(with("speed = 100", "speed = 100\nx = 1"), @r#"brake.toml:31: initial.x: unknown key; [initial] has speed"#);
    insta::assert_snapshot!(with("from = 6.96", "from = 6.96\nintervall = 1e-5"), @r#"brake.toml:49: output.window.0.intervall: unknown key; did you mean output.window.0.interval?"#);
    insta::assert_snapshot!(with("title =", "zzz = 1\ntitle ="), @r#"brake.toml:1: zzz: unknown key; there are title, axial, actuation, torsion, contact, friction, initial, perturbation, solver, output"#);
}

#[test]
fn a_quoted_key_with_a_dot_is_no_path() {
    insta::assert_snapshot!(with("mass = 4.54", "mass = 4.54\n\"x.y\" = 1"), @r#"brake.toml:5: axial."x.y": unknown key; [axial] has mass, stiffness, damping, ringing_floor"#);
    insta::assert_snapshot!(with("title =", "\"torsion.damping\" = 1\ntitle ="), @r#"brake.toml:1: "torsion.damping": unknown key; did you mean torsion?"#);
    insta::assert_snapshot!(with("title =", "\"output.window\" = []\ntitle ="), @r#"brake.toml:1: "output.window": unknown key; did you mean output?"#);
}

#[test]
fn a_missing_key_names_its_table_and_how_to_write_it() {
    insta::assert_snapshot!(with("mass = 4.54\n", ""), @r#"brake.toml:3: axial.mass: missing: m, the rotor mass; write mass = a number in kg or "10 lbm""#);
    insta::assert_snapshot!(with("damping = \"200 lbf in s/rad\"\n", ""), @r#"brake.toml:13: torsion.damping: missing: c_t, torsional contact damping of each disk; write damping = a number in N m s/rad or "200 lbf in s/rad""#);
    insta::assert_snapshot!(with("breakaway = 0.6\n", ""), @r#"brake.toml:23: friction.breakaway: missing: mu_0, friction coefficient at rest; at least low_speed; write breakaway = a number"#);
    insta::assert_snapshot!(with("profile = \"ramp\"\n", ""), @r#"brake.toml:8: actuation.profile: missing: whether the force is a ramp that then holds, or a table; write profile = "ramp" or "table""#);
    insta::assert_snapshot!(with("rise_time = 1.0\n", ""), @r#"brake.toml:8: actuation.rise_time: missing: t_0, application time; 0 is a step at t = 0; write rise_time = a number in s or "1 ms""#);
    insta::assert_snapshot!(with("time = 6.9697\n", ""), @r#"brake.toml:32: perturbation.0.time: missing: when the kick comes: a time, or "instability"; write time = a number in s or "1 ms""#);
    insta::assert_snapshot!(with("to = 6.992\n", ""), @r#"brake.toml:47: output.window.0.to: missing: end of that stretch; write to = a number in s or "1 ms""#);
    insta::assert_snapshot!(with("radius = 0.052388\n", ""), @r#"brake.toml:19: contact.radius: missing: r, the effective friction radius; give radius, or outer_diameter, inner_diameter and wear"#);
    insta::assert_snapshot!(with("[initial]\nspeed = 100\n", ""), @r#"brake.toml: initial.speed: missing: omega_0, initial speed of the rotor and of its surface; write speed = a number in rad/s or "955 rpm""#);
}

#[test]
fn a_wrong_type_is_named() {
    insta::assert_snapshot!(with("mass = 4.54", "mass = true"), @r#"brake.toml:4: axial.mass: expected a mass, kg, but got true"#);
    insta::assert_snapshot!(with("mass = 4.54", "mass = [4.54]"), @r#"brake.toml:4: axial.mass: expected a mass, kg, but got an array"#);
    insta::assert_snapshot!(with("mass = 4.54", "mass = 2016-01-01"), @r#"brake.toml:4: axial.mass: expected a mass, kg, but got a date"#);
    insta::assert_snapshot!(with("breakaway = 0.6", "breakaway = \"0.6\""), @r#"brake.toml:24: friction.breakaway: expected a plain number, without quotes or unit, but got "0.6""#);
    insta::assert_snapshot!(with("breakaway = 0.6", "breakaway = {}"), @r#"brake.toml:24: friction.breakaway: expected a plain number, but got a table"#);
    insta::assert_snapshot!(with("title = \"A brake\"", "title = 1"), @r#"brake.toml:1: title: expected text in quotes, but got the number 1"#);
    insta::assert_snapshot!(with("profile = \"ramp\"", "profile = 1"), @r#"brake.toml:9: actuation.profile: expected one of "ramp", "table", but got the number 1"#);
    insta::assert_snapshot!(with("steps = false", "steps = 1"), @r#"brake.toml:45: output.steps: expected true or false, but got the number 1"#);
    insta::assert_snapshot!(with("max_events = 1000", "max_events = 1e3"), @r#"brake.toml:40: solver.max_events: expected a whole number of at least 1, but got the number 1000.0"#);
    insta::assert_snapshot!(with("[initial]\nspeed = 100", "[[initial]]\nspeed = 100"), @r#"brake.toml:29: initial: expected a table, but got an array"#);
    insta::assert_snapshot!(with("[[perturbation]]", "[perturbation]"), @r#"brake.toml:32: perturbation: expected an array of tables: write [[perturbation]], or perturbation = []"#);
    insta::assert_snapshot!(with("[[output.window]]", "[output.window]"), @r#"brake.toml:47: output.window: expected an array of tables: write [[output.window]], or output.window = []"#);
    insta::assert_snapshot!(first_problem("perturbation = [1]"), @r#"brake.toml:1: perturbation.0: expected a table, but got the number 1"#);
    insta::assert_snapshot!(first_problem("\naxial = 1"), @r#"brake.toml:2: axial: expected a table, but got the number 1"#);
}

#[test]
fn a_wrong_unit_says_what_was_expected_and_what_it_is() {
    insta::assert_snapshot!(with("stiffness = 7.71e6", "stiffness = \"3.161e5 lbf/in\""), @r#"brake.toml:16: torsion.stiffness: expected a torsional stiffness, N m/rad, but "3.161e5 lbf/in" is a stiffness, N/m"#);
    insta::assert_snapshot!(with("damping = \"200 lbf in s/rad\"", "damping = \"200 lbf in/rad\""), @r#"brake.toml:17: torsion.damping: expected a torsional damping coefficient, N m s/rad, but "200 lbf in/rad" is a torsional stiffness, N m/rad"#);
    insta::assert_snapshot!(with("force = \"500 lbf\"", "force = \"500 lbm\""), @r#"brake.toml:10: actuation.force: expected a force, N, but "500 lbm" is a mass, kg"#);
    insta::assert_snapshot!(with("force = \"500 lbf\"", "force = \"500 m^3\""), @r#"brake.toml:10: actuation.force: expected a force, N, but "500 m^3" is in m^3"#);
    insta::assert_snapshot!(with("force = \"500 lbf\"", "force = \"500 deg\""), @r#"brake.toml:10: actuation.force: expected a force, N, but "500 deg" is an angle, rad"#);
    insta::assert_snapshot!(with("force = \"500 lbf\"", "force = \"500 lbf rad\""), @r#"brake.toml:10: actuation.force: expected a force, N, but "500 lbf rad" is in kg m s^-2 rad"#);
    insta::assert_snapshot!(with("force = \"500 lbf\"", "force = \"500 m/m\""), @r#"brake.toml:10: actuation.force: expected a force, N, but "500 m/m" is a plain number"#);
    insta::assert_snapshot!(with("breakaway = 0.6", "breakaway = \"0.6 m\""), @r#"brake.toml:24: friction.breakaway: expected a plain number, without quotes or unit, but got "0.6 m""#);
}

#[test]
fn a_quantity_that_cannot_be_read_says_how_it_is_written() {
    insta::assert_snapshot!(with("force = \"500 lbf\"", "force = \"500\""), @r#"brake.toml:10: actuation.force: "500" has no unit: write 500 without quotes if it is in N, or add the unit, such as "500 lbf""#);
    insta::assert_snapshot!(with("force = \"500 lbf\"", "force = \"much\""), @r#"brake.toml:10: actuation.force: "much" is not a quantity: expected a force, N, such as "500 lbf""#);
    insta::assert_snapshot!(with("force = \"500 lbf\"", "force = \"\""), @r#"brake.toml:10: actuation.force: "" is not a quantity: expected a force, N, such as "500 lbf""#);
    insta::assert_snapshot!(with("force = \"500 lbf\"", "force = \"500 lb\""), @r#"brake.toml:10: actuation.force: unknown unit "lb": write lbm for mass or lbf for force"#);
    insta::assert_snapshot!(with("force = \"500 lbf\"", "force = \"500 Kip\""), @r#"brake.toml:10: actuation.force: unknown unit "Kip": did you mean "kip"?"#);
    insta::assert_snapshot!(with("force = \"500 lbf\"", "force = \"500 parsec\""), @r#"brake.toml:10: actuation.force: unknown unit "parsec": the units are kg m s rad t g mg lbm slug km cm mm um µm nm in ft ms us µs ns min h N mN kN MN GN lbf kip kgf J kJ W kW mrad urad µrad deg rev rpm Hz kHz MHz"#);
    insta::assert_snapshot!(with("force = \"500 lbf\"", "force = \"500 lbf/(in s)\""), @r#"brake.toml:10: actuation.force: the unit "lbf/(in s)" cannot be read: parentheses are not used; a "/" divides by the next unit only, so write N/m/s for N/(m s)"#);
    insta::assert_snapshot!(with("force = \"500 lbf\"", "force = \"500 lbf/\""), @r#"brake.toml:10: actuation.force: the unit "lbf/" cannot be read: a unit is missing at its end"#);
    insta::assert_snapshot!(with("force = \"500 lbf\"", "force = \"500 lbf + 1 N\""), @r#"brake.toml:10: actuation.force: the unit "lbf + 1 N" cannot be read: "+" is not expected"#);
    insta::assert_snapshot!(with("force = \"500 lbf\"", "force = \"500 lbf^99\""), @r#"brake.toml:10: actuation.force: the unit "lbf^99" cannot be read: a power is a small whole number, as in m^2"#);
    insta::assert_snapshot!(with("force = \"500 lbf\"", "force = \"5e999999999999 lbf\""), @r#"brake.toml:10: actuation.force: 5e999999999999 is outside the range of double precision"#);
    insta::assert_snapshot!(with("force = \"500 lbf\"", "force = \"1e308 lbf\""), @r#"brake.toml:10: actuation.force: "1e308 lbf" is too large for double precision"#);
}

#[test]
fn a_number_outside_its_limits_is_refused() {
    insta::assert_snapshot!(with("mass = 4.54", "mass = nan"), @r#"brake.toml:4: axial.mass: must be finite, but is NaN"#);
    insta::assert_snapshot!(with("mass = 4.54", "mass = inf"), @r#"brake.toml:4: axial.mass: must be finite, but is inf"#);
    insta::assert_snapshot!(with("mass = 4.54", "mass = 0"), @r#"brake.toml:4: axial.mass: must be greater than 0, but is 0.0"#);
    insta::assert_snapshot!(with("rotor_inertia = 2.262", "rotor_inertia = \"-20 slug in ft\""), @r#"brake.toml:14: torsion.rotor_inertia: must be greater than 0, but is "-20 slug in ft", -2.259696580552334 kg m^2"#);
    insta::assert_snapshot!(with("surface_inertia = 0.0113", "surface_inertia = 0.0"), @r#"brake.toml:15: torsion.surface_inertia: must be greater than 0, but is 0.0"#);
    insta::assert_snapshot!(with("stiffness = 7.71e6", "stiffness = 0"), @r#"brake.toml:16: torsion.stiffness: must be greater than 0, but is 0.0"#);
    insta::assert_snapshot!(with("stiffness = \"55.38 MN/m\"", "stiffness = -1"), @r#"brake.toml:5: axial.stiffness: must be greater than 0, but is -1.0"#);
    insta::assert_snapshot!(with("damping = 8760", "damping = 8760\nringing_floor = 0"), @r#"brake.toml:7: axial.ringing_floor: must be greater than 0, but is 0.0"#);
    insta::assert_snapshot!(with("damping = 8760", "damping = -8760"), @r#"brake.toml:6: axial.damping: must not be negative, but is -8760.0"#);
    insta::assert_snapshot!(with("high_speed = 0.3", "high_speed = -0.3"), @r#"brake.toml:26: friction.high_speed: must not be negative, but is -0.3"#);
    insta::assert_snapshot!(with("decay = 3.5", "decay = -3.5"), @r#"brake.toml:27: friction.decay: must not be negative, but is -3.5"#);
    insta::assert_snapshot!(with("radius = 0.052388", "radius = 0"), @r#"brake.toml:20: contact.radius: must be greater than 0, but is 0.0"#);
    insta::assert_snapshot!(with("rise_time = 1.0", "rise_time = \"-1 ms\""), @r#"brake.toml:11: actuation.rise_time: must not be negative, but is "-1 ms", -0.001 s"#);
    insta::assert_snapshot!(with("time = 6.9697", "time = -1"), @r#"brake.toml:34: perturbation.0.time: must not be negative, but is -1.0"#);
    insta::assert_snapshot!(with("relative_velocity = 1e-4", "relative_velocity = nan"), @r#"brake.toml:35: perturbation.0.relative_velocity: must be finite, but is NaN"#);
    insta::assert_snapshot!(with("rtol = 1e-10", "rtol = 0.2"), @r#"brake.toml:39: solver.rtol: must be from 2e-15 to 0.1, but is 0.2"#);
    insta::assert_snapshot!(with("rtol = 1e-10", "rtol = 0"), @r#"brake.toml:39: solver.rtol: must be from 2e-15 to 0.1, but is 0.0"#);
    insta::assert_snapshot!(with("max_events = 1000", "max_events = 0"), @r#"brake.toml:40: solver.max_events: expected a whole number of at least 1, but got the number 0"#);
    insta::assert_snapshot!(with("end_time = 10", "end_time = 0"), @r#"brake.toml:43: output.end_time: must be greater than 0, but is 0.0"#);
    insta::assert_snapshot!(with("interval = 0.01", "interval = 0"), @r#"brake.toml:44: output.interval: must be greater than 0, but is 0.0"#);
    insta::assert_snapshot!(with("interval = 1e-5", "interval = -1e-5"), @r#"brake.toml:50: output.window.0.interval: must be greater than 0, but is -1e-5"#);
}

#[test]
fn a_name_that_is_none_of_the_list_is_answered_with_the_list() {
    insta::assert_snapshot!(with("method = \"cvode\"", "method = \"cvode-bfd\""), @r#"brake.toml:38: solver.method: there is no "cvode-bfd"; did you mean "cvode-bdf"?"#);
    insta::assert_snapshot!(with("breakaway_test = \"transmitted\"", "breakaway_test = \"both\""), @r#"brake.toml:21: contact.breakaway_test: expected one of "transmitted", "stator", "rotor", but got "both""#);
    insta::assert_snapshot!(with("profile = \"ramp\"", "profile = \"step\""), @r#"brake.toml:9: actuation.profile: expected one of "ramp", "table", but got "step""#);
    insta::assert_snapshot!(with("kind = \"kick\"", "kind = \"push\""), @r#"brake.toml:33: perturbation.0.kind: expected "kick", but got "push""#);
    insta::assert_snapshot!(with("time = 6.9697", "time = \"instabilty\""), @r#"brake.toml:34: perturbation.0.time: expected a time, s, or "instability", but got "instabilty""#);
}

#[test]
fn breakaway_below_low_speed_is_refused_and_low_speed_below_high_speed_is_not() {
    insta::assert_snapshot!(with("breakaway = 0.6", "breakaway = 0.5"), @r#"brake.toml:24: friction.breakaway: must be at least friction.low_speed: 0.5 is below 0.6, and between the two torques neither stick nor slip is consistent; raise breakaway or lower low_speed"#);
    accepted("high_speed = 0.3", "high_speed = 0.9");
}

/// The case with another friction table, whose heading is in line 23.
fn with_friction(table: &str) -> String {
    let start = VALID.find("breakaway = 0.6").unwrap();
    let end = VALID.find("\n[initial]").unwrap();
    with(&VALID[start..end], &format!("{table}\n"))
}

#[test]
fn a_friction_law_takes_its_own_keys() {
    let coulomb = with_friction("law = \"coulomb\"\nbreakaway = 0.6\ndecay = 3.5");
    assert_eq!(
        coulomb,
        "brake.toml:23: friction.kinetic: missing: mu_d, friction coefficient at every sliding speed; write kinetic = a number\n\
         brake.toml:26: friction.decay: belongs to law \"exponential\", but the law is \"coulomb\": remove it, or change friction.law"
    );
    assert_eq!(
        with("decay = 3.5", "decay = 3.5\nscale = 0.5"),
        "brake.toml:28: friction.scale: belongs to law \"hyperbolic\" or \"stribeck\", but the law is \"exponential\", the default: \
         remove it, or change friction.law"
    );
    assert_eq!(
        with_friction("law = \"colomb\"\nbreakaway = 0.6"),
        "brake.toml:24: friction.law: expected one of \"exponential\", \"coulomb\", \"asymmetric\", \"hyperbolic\", \"stribeck\", \"polynomial\", \
         \"table\", but got \"colomb\"; did you mean \"coulomb\"?"
    );
    assert_eq!(
        with_friction("law = \"coulomb\"\nbreakaway = 0.2\nkinetic = 0.3"),
        "brake.toml:25: friction.breakaway: must be at least friction.kinetic: 0.2 is below 0.3, and between the two torques neither \
         stick nor slip is consistent; raise breakaway or lower kinetic"
    );
    assert_eq!(
        with_friction("law = \"asymmetric\"\nbreakaway = 0.6\nkinetic = 0.3"),
        "brake.toml:23: friction.kinetic_backward: missing: mu_d-, friction coefficient in backward sliding, omega_r < 0; kinetic is \
         then that in forward sliding; write kinetic_backward = a number\n\
         brake.toml:23: friction.breakaway_backward: missing: mu_0-, friction coefficient at rest against backward sliding; breakaway \
         is then that against forward sliding; write breakaway_backward = a number"
    );
    assert_eq!(
        with_friction(
            "law = \"asymmetric\"\nbreakaway = 0.6\nkinetic = 0.3\nbreakaway_backward = 0.2\nkinetic_backward = 0.3"
        ),
        "brake.toml:27: friction.breakaway_backward: must be at least friction.kinetic_backward: 0.2 is below 0.3, and between the \
         two torques neither stick nor slip is consistent; raise breakaway_backward or lower kinetic_backward"
    );
    let stribeck = with_friction(
        "law = \"stribeck\"\nbreakaway = 0.6\nlow_speed = 0.6\nhigh_speed = 0.3\nscale = \"10 rpm\"\nexponent = 0.5",
    );
    assert!(
        stribeck.starts_with("brake.toml:29: friction.exponent: must be 1, 2, 3 or 4, but is 0.5: "),
        "{stribeck}"
    );
}

#[test]
fn a_polynomial_is_valid_where_the_case_needs_it() {
    let polynomial = |more: &str| {
        with_friction(&format!(
            "law = \"polynomial\"\nbreakaway = 0.6\nlow_speed = 0.6\nlinear = -0.01\n{more}"
        ))
    };
    assert_eq!(
        polynomial("valid_below = 50"),
        "brake.toml:31: initial.speed: must be below friction.valid_below, where the friction law ends: 100.0 rad/s is not below \
         50.0 rad/s; start slower, raise valid_below if the law holds there, or take a law that is given at every speed"
    );
    let negative = polynomial("valid_below = 120");
    assert!(
        negative.starts_with(
            "brake.toml:28: friction.valid_below: must be a speed up to which the friction coefficient is not negative"
        ),
        "{negative}"
    );
}

#[test]
fn the_points_of_a_friction_table_make_a_curve() {
    let table = |speed: &str, coefficient: &str| {
        with_friction(&format!(
            "law = \"table\"\nbreakaway = 0.6\nspeed = {speed}\ncoefficient = {coefficient}"
        ))
    };
    let expected = "brake.toml:26: friction.speed.2: speeds must increase: 1.0 rad/s follows 2.0 rad/s";
    assert_eq!(table("[0, 2, 1]", "[0.6, 0.4, 0.3]"), expected);
    assert_eq!(
        table("[0.1, 2]", "[0.6, 0.4, 0.3]"),
        "brake.toml:26: friction.speed.0: the first point must be at standstill: write 0 in place of 0.1 rad/s, or add such a point\n\
         brake.toml:27: friction.coefficient: must be as long as friction.speed: 3 coefficients for 2 speeds"
    );
    let expected = "brake.toml:27: friction.coefficient.1: must not be negative, but is -0.4";
    assert_eq!(table("[0, \"20 rpm\"]", "[0.6, -0.4]"), expected);
    let expected = "brake.toml:26: friction.speed: must hold at least two speeds, the first of them 0";
    assert_eq!(table("[0]", "[0.6]"), expected);
}

#[test]
fn the_radius_is_given_once_and_completely() {
    let radius = "radius = 0.052388";
    insta::assert_snapshot!(with(radius, "radius = 0.05\nouter_diameter = 0.15\ninner_diameter = 0.05\nwear = \"uniform-wear\""), @r#"brake.toml:20: contact.radius: the radius is given twice, with contact.outer_diameter (brake.toml:21): keep either radius, or outer_diameter, inner_diameter and wear"#);
    insta::assert_snapshot!(with(radius, "outer_diameter = 0.15"), @r#"
brake.toml:19: contact.inner_diameter: missing: d, inner diameter of the contact; write inner_diameter = a number in m or "2.0625 in"
brake.toml:19: contact.wear: missing: which formula gives r: uniform wear (6) or uniform pressure (7); write wear = "uniform-wear" or "uniform-pressure"
"#);
    insta::assert_snapshot!(with(radius, "outer_diameter = 0.05\ninner_diameter = 0.15\nwear = \"uniform-wear\""), @r#"brake.toml:21: contact.inner_diameter: must be smaller than outer_diameter: 0.15 m is not below 0.05 m"#);
    insta::assert_snapshot!(with(radius, "outer_diameter = 0.15\ninner_diameter = -0.05\nwear = \"uniform\""), @r#"
brake.toml:21: contact.inner_diameter: must not be negative, but is -0.05
brake.toml:22: contact.wear: expected one of "uniform-wear", "uniform-pressure", but got "uniform"; did you mean "uniform-wear"?
"#);
}

#[test]
fn diameters_that_give_no_radius_are_refused() {
    let form = "outer_diameter = 5e-324\ninner_diameter = 0\nwear = \"uniform-wear\"";
    insta::assert_snapshot!(with("radius = 0.052388", form), @r#"brake.toml:20: contact.outer_diameter: gives a radius that must be greater than 0, but is 0.0 m"#);
    let form = "outer_diameter = 1.7e308\ninner_diameter = 1.6e308\nwear = \"uniform-wear\"";
    insta::assert_snapshot!(with("radius = 0.052388", form), @r#"brake.toml:20: contact.outer_diameter: gives a radius that must be finite, but is inf m"#);
}

/// Equations (6) and (7) evaluated by hand: D = 6 in, d = 3 in give 2.25 in and 7/3 in.
#[test]
fn analytic_radius_from_the_diameters_of_the_contact() {
    let form = |wear: &str| format!("outer_diameter = \"6 in\"\ninner_diameter = \"3 in\"\nwear = \"{wear}\"");
    for (wear, inches) in [("uniform-wear", 2.25), ("uniform-pressure", 7.0 / 3.0)] {
        let radius = accepted("radius = 0.052388", &form(wear)).system.radius;
        // Half a dozen operations, each with a rounding error of 1.1e-16.
        assert!((radius / (inches * 0.0254) - 1.0).abs() < 1e-15, "{wear}: {radius}");
    }
    let solid = accepted("radius = 0.052388", &form("uniform-pressure").replace("3 in", "0 in"));
    assert!((solid.system.radius / (2.0 * 0.0254) - 1.0).abs() < 1e-15);
}

#[test]
fn a_table_of_forces_is_complete_and_increases_in_time() {
    let ramp = "profile = \"ramp\"\nforce = \"500 lbf\"\nrise_time = 1.0";
    let table = |time: &str, force: &str| format!("profile = \"table\"\ntime = {time}\nforce = {force}");
    accepted(ramp, &table("[0, \"1 ms\", 2.0]", "[0, \"500 lbf\", -1.0]"));
    accepted(ramp, &table("[0]", "[2225]"));
    insta::assert_snapshot!(with(ramp, &table("[]", "[]")), @r#"brake.toml:10: actuation.time: must hold at least one time"#);
    accepted(ramp, &table("[0, 1, 1]", "[0, 1, 2]"));
    insta::assert_snapshot!(with(ramp, &table("[0, 1, 1, 1]", "[0, 1, 2, 3]")), @r#"brake.toml:10: actuation.time.3: two points of one time are a step, but 1.0 s has three: remove the one in the middle"#);
    insta::assert_snapshot!(with(ramp, &table("[0, 1,\n 0.5]", "[0, 1, 2]")), @r#"brake.toml:11: actuation.time.2: times must increase: 0.5 s follows 1.0 s"#);
    insta::assert_snapshot!(with(ramp, &table("[0, 1, 2]", "[0, 1]")), @r#"brake.toml:11: actuation.force: must be as long as actuation.time: 2 forces for 3 times"#);
    insta::assert_snapshot!(with(ramp, &table("[0, 1]", "[0,\n \"1 s\"]")), @r#"brake.toml:12: actuation.force.1: expected a force, N, but "1 s" is a time, s"#);
    insta::assert_snapshot!(with(ramp, &table("[0, 1]", "[0, inf]")), @r#"brake.toml:11: actuation.force.1: must be finite, but is inf"#);
    insta::assert_snapshot!(with(ramp, &table("[0, 1]", "2225")), @r#"brake.toml:11: actuation.force: expected an array of numbers, but got the number 2225"#);
    insta::assert_snapshot!(with(ramp, "profile = \"table\"\ntime = [0, 1]"), @r#"brake.toml:8: actuation.force: missing: F at these times, linear in between; positive presses the disks together; write force = [...], numbers in N"#);
    insta::assert_snapshot!(with(ramp, &format!("{}\nrise_time = 1", table("[0, 1]", "[0, 1]"))), @r#"brake.toml:12: actuation.rise_time: belongs to profile "ramp", but the profile is "table": remove it, or change the profile"#);
    insta::assert_snapshot!(with(ramp, &format!("{ramp}\ntime = [0, 1]")), @r#"brake.toml:12: actuation.time: belongs to profile "table", but the profile is "ramp": remove it, or change the profile"#);
}

#[test]
fn a_window_ends_after_it_begins() {
    insta::assert_snapshot!(with("to = 6.992", "to = 6.96"), @r#"brake.toml:49: output.window.0.to: must be after from: 6.96 s is not after 6.96 s"#);
}

#[test]
fn an_end_time_that_doubles_cannot_resolve_is_refused() {
    insta::assert_snapshot!(with("end_time = 10", "end_time = 1e-300"), @r#"brake.toml:43: output.end_time: must be at least 1e-12 s, but is 1e-300 s"#);
    insta::assert_snapshot!(with("end_time = 10\ninterval = 0.01", "end_time = 1e9\ninterval = 10"), @r#"brake.toml:43: output.end_time: is too late for double precision: times near 1000000000.0 s are 2e-7 s apart, and the natural period 2 pi sqrt(torsion.surface_inertia/torsion.stiffness) is 2e-4 s; end earlier"#);
    insta::assert_snapshot!(with("stiffness = \"55.38 MN/m\"", "stiffness = 1e300"), @r#"brake.toml:43: output.end_time: is too late for double precision: times near 10.0 s are 2e-15 s apart, and the axial period 2 pi sqrt(axial.mass/axial.stiffness) is 1e-149 s; end earlier"#);
}

#[test]
fn a_rise_too_short_for_a_step_is_refused() {
    accepted("rise_time = 1.0", "rise_time = 0");
    insta::assert_snapshot!(with("rise_time = 1.0", "rise_time = 1e-300"), @r#"brake.toml:11: actuation.rise_time: must be 0 (a step) or at least 1e-12 s, but is 1e-300 s"#);
}

#[test]
fn an_absurd_number_of_samples_is_refused_where_it_comes_from() {
    insta::assert_snapshot!(with("interval = 0.01", "interval = 1e-9"), @r#"brake.toml:44: output.interval: asks for 1.0e10 samples, more than 1e9: raise the interval or end earlier"#);
    insta::assert_snapshot!(with("interval = 1e-5", "interval = 1e-12"), @r#"brake.toml:50: output.window.0.interval: asks for 3.2e10 samples, more than 1e9: raise the interval or end earlier"#);
    insta::assert_snapshot!(with("end_time = 10", "end_time = 1e8"), @r#"brake.toml:44: output.interval: asks for 1.0e10 samples, more than 1e9: raise the interval or end earlier"#);
}

#[test]
fn all_problems_are_reported_at_once() {
    let text = VALID
        .replace("mass = 4.54", "mass = -1\ncolour = \"red\"")
        .replace("decay = 3.5\n", "")
        .replace("method = \"cvode\"", "method = \"magic\"");
    insta::assert_snapshot!(parse(&text).unwrap_err(), @r#"
brake.toml:4: axial.mass: must be greater than 0, but is -1.0
brake.toml:5: axial.colour: unknown key; [axial] has mass, stiffness, damping, ringing_floor
brake.toml:24: friction.decay: missing: alpha, decay of the friction coefficient with sliding speed; write decay = a number in s/rad or "5 s/rad"
brake.toml:38: solver.method: expected one of "cvode", "arkode", "cvode-bdf", "cvode-adams", "erk", "esdirk", "series", "paper", "rk4" and 23 more (`stickslip case --keys KEY` lists them), but got "magic"
"#);
}

#[test]
fn an_empty_file_lists_what_is_missing() {
    insta::assert_snapshot!(parse("").unwrap_err(), @r#"
brake.toml: axial.mass: missing: m, the rotor mass; write mass = a number in kg or "10 lbm"
brake.toml: axial.stiffness: missing: k_e, equivalent axial stiffness; write stiffness = a number in N/m or "3.161e5 lbf/in"
brake.toml: axial.damping: missing: c_a, axial damping; write damping = a number in N s/m or "50 lbf s/in"
brake.toml: actuation.profile: missing: whether the force is a ramp that then holds, or a table; write profile = "ramp" or "table"
brake.toml: torsion.rotor_inertia: missing: I, the rotor inertia; write rotor_inertia = a number in kg m^2 or "20 slug in ft"
brake.toml: torsion.surface_inertia: missing: J, inertia of each contact surface; write surface_inertia = a number in kg m^2 or "20 slug in ft"
brake.toml: torsion.stiffness: missing: k_t, torsional contact stiffness of each disk; write stiffness = a number in N m/rad or "6.822e7 lbf in/rad"
brake.toml: torsion.damping: missing: c_t, torsional contact damping of each disk; write damping = a number in N m s/rad or "200 lbf in s/rad"
brake.toml: friction.breakaway: missing: mu_0, friction coefficient at rest; at least low_speed; write breakaway = a number
brake.toml: friction.low_speed: missing: mu_s, friction coefficient at vanishing sliding speed; write low_speed = a number
brake.toml: friction.high_speed: missing: mu_d, friction coefficient at high sliding speed; write high_speed = a number
brake.toml: friction.decay: missing: alpha, decay of the friction coefficient with sliding speed; write decay = a number in s/rad or "5 s/rad"
brake.toml: initial.speed: missing: omega_0, initial speed of the rotor and of its surface; write speed = a number in rad/s or "955 rpm"
brake.toml: contact.radius: missing: r, the effective friction radius; give radius, or outer_diameter, inner_diameter and wear
"#);
}

#[test]
fn a_file_that_cannot_be_read_is_named() {
    let error = CaseSource::file(&PathBuf::from("no/such/case.toml"))
        .unwrap_err()
        .to_string();
    assert!(
        error.starts_with("no/such/case.toml: the case file cannot be read: "),
        "{error}"
    );
}

#[test]
fn a_file_that_is_not_text_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("result.toml");
    std::fs::write(&path, b"\x89HDF\r\n\x1a\n\xff").unwrap();
    let error = CaseSource::file(&path).unwrap_err().to_string();
    assert!(
        error.ends_with("result.toml: not a case file: expected TOML, which is UTF-8 text"),
        "{error}"
    );
}

#[test]
fn deeply_nested_input_is_an_error_and_no_overflow() {
    let nested = format!("title = {}{}", "[".repeat(100_000), "]".repeat(100_000));
    assert!(parse(&nested).is_err());
    let dotted = format!("{} = 1", vec!["a"; 100_000].join("."));
    assert!(parse(&dotted).is_err());
}
