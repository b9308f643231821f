//! Distributions of the axes of a sample.

use crate::common::cli::{Folder, refusal, says};
use crate::common::rows;
use stickslip::sweep::AxisDistribution;

/// A run of milliseconds, with one axis of each distribution.
const STUDY: &str = r#"
title = "measured scatter"
case = "paper"
set = { output.end_time = 0.01, output.interval = 0.005, solver.method = "series", actuation.rise_time = 0.01 }
sample = { method = "latin-hypercube", count = 60, seed = 3 }
axis = [
    { key = "friction.decay", distribution = "normal", mean = 5, deviation = 0.1 },
    { key = "torsion.damping", distribution = "lognormal", median = "20 N m s/rad", factor = 1.2 },
    { key = "initial.speed", distribution = "triangular", from = 90, to = 110, mode = 95 },
    { key = "actuation.force", distribution = "table", table = "force.csv" },
    { key = "torsion.stiffness", distribution = "uniform", from = 3e5, to = 4e5 },
]
"#;

const FORCE: &str = "force [N]\n2300\n2200\n# a second day\n2500\n2.25 kN\n";

fn with_study(method: &str) -> Folder {
    let folder = Folder::new();
    folder.write("force.csv", FORCE);
    folder.write("d.toml", STUDY.replace("latin-hypercube", method));
    folder
}

/// Published quantiles of the normal distribution, in the middle, at the sides and in the tail, and closed forms.
#[test]
fn cli_distributions_have_published_quantiles() {
    let normal = AxisDistribution::Normal {
        mean: 0.0,
        deviation: 1.0,
    };
    for (share, quantile) in [
        (0.5, 0.0),
        (0.75, 0.674_489_750_196_081_7),
        (0.9, 1.281_551_565_544_600_4),
        (0.975, 1.959_963_984_540_054),
        (0.99, 2.326_347_874_040_841),
        (0.999, 3.090_232_306_167_813_5),
        (1e-10, -6.361_340_902_404_056),
    ] {
        let found = normal.at(share);
        assert!((found - quantile).abs() <= 1e-15 * quantile.abs(), "{share}: {found}");
        assert!((normal.at(1.0 - share) + quantile).abs() < 1e-6, "{share}");
    }
    let lognormal = AxisDistribution::Lognormal {
        median: 20.0,
        factor: 1.2,
    };
    // One standard deviation is a factor.
    assert!((lognormal.at(0.841_344_746_068_542_9) - 24.0).abs() < 1e-12);
    let triangular = AxisDistribution::Triangular {
        from: 90.0,
        to: 110.0,
        mode: 95.0,
    };
    assert_eq!(
        (triangular.at(0.0625), triangular.at(0.25), triangular.at(0.5)),
        (92.5, 95.0, 110.0 - 150f64.sqrt())
    );
    let table = AxisDistribution::Table {
        path: "x.csv".into(),
        values: vec![1.0, 2.0, 4.0],
    };
    assert_eq!((table.at(0.25), table.at(0.5), table.at(0.75)), (1.5, 2.0, 3.0));
}

/// Of a Latin hypercube, exactly one value lies between two neighbouring quantiles. Of a Sobol sequence, the shares are
/// nearly those. All values are finite.
#[test]
fn cli_samples_are_distributed_as_asked() {
    for (method, most) in [("latin-hypercube", 0), ("sobol", 3)] {
        let folder = with_study(method);
        folder.ok("sweep d.toml -q");
        let file = folder.sweep_file("d.h5");
        let axes = [
            (
                "friction_decay",
                AxisDistribution::Normal {
                    mean: 5.0,
                    deviation: 0.1,
                },
            ),
            (
                "torsion_damping",
                AxisDistribution::Lognormal {
                    median: 20.0,
                    factor: 1.2,
                },
            ),
            (
                "initial_speed",
                AxisDistribution::Triangular {
                    from: 90.0,
                    to: 110.0,
                    mode: 95.0,
                },
            ),
            (
                "actuation_force",
                AxisDistribution::Table {
                    path: "force.csv".into(),
                    values: vec![2200.0, 2250.0, 2300.0, 2500.0],
                },
            ),
        ];
        for (name, distribution) in axes {
            let values = file.numbers(name).unwrap();
            assert!(values.iter().all(|value| value.is_finite()), "{name}");
            for k in 1..60usize {
                let quantile = distribution.at(k as f64 / 60.0);
                let below = values.iter().filter(|value| **value < quantile).count();
                assert!(below.abs_diff(k) <= most, "{method}, {name}: {below} of {k}");
            }
        }
        let uniform = file.numbers("torsion_stiffness").unwrap();
        assert!(uniform.iter().all(|value| (3e5..4e5).contains(value)));
        assert!(
            file.input("study")
                .unwrap()
                .unwrap()
                .contains("distribution = \"normal\"")
        );
    }
}

/// Parts of the sample on several machines, and a second start, give the same bytes.
#[test]
fn cli_a_distributed_sample_is_the_same_in_parts() {
    let folder = with_study("latin-hypercube");
    folder.ok("sweep d.toml -q -j 2");
    let whole = folder.read("d.h5");
    for part in ["1/2", "2/2"] {
        folder.ok(&format!("sweep d.toml -q --shard {part}"));
    }
    folder.ok("merge d.shard-1-of-2.h5 d.shard-2-of-2.h5 -o merged.h5");
    assert!(folder.read("merged.h5") == whole);
    folder.ok("sweep d.toml -q -j 1");
    assert!(folder.read("d.h5") == whole);
}

#[test]
fn cli_a_wrong_distribution_is_refused_with_the_remedy() {
    for [line, words] in rows(
        r#"
        distribution = "gauss", mean = 5, deviation = 1            | distribution & "uniform", "normal"
        distribution = "normal", mean = 5                          | deviation & missing
        distribution = "normal", mean = 5, deviation = 0           | deviation & greater than 0
        distribution = "normal", mean = 5, deviation = 1, from = 3 | from & not of the distribution & mean, deviation
        distribution = "lognormal", median = 5, factor = 1         | factor & greater than 1
        distribution = "triangular", from = 1, to = 2, mode = 3    | mode & between them
        distribution = "table", table = "no.csv"                   | no.csv & no such file
        distribution = "table", table = "bad.csv"                  | bad.csv:3
        distribution = "table", table = "one.csv"                  | one.csv & fewer than two
        mean = 5, deviation = 1                                    | mean & not of the distribution "uniform"
    "#,
    ) {
        let folder = with_study("sobol");
        folder.write("bad.csv", "1.5\n1.6\nlarge\n");
        folder.write("one.csv", "1.5\n");
        let text = STUDY.replace("distribution = \"normal\", mean = 5, deviation = 0.1", line);
        folder.write("d.toml", text.replace("latin-hypercube", "sobol"));
        says(&refusal(&mut folder.stickslip("sweep d.toml")), words);
        assert!(!folder.names().contains(&"d.h5".to_owned()));
    }
    // A grid has no distribution.
    let folder = with_study("sobol");
    folder.write("d.toml", STUDY.replace("sample = ", "# "));
    folder.refused("sweep d.toml", "distribution & [sample]");
    // The table is an input.
    let folder = with_study("sobol");
    folder.refused("sweep d.toml -o force.csv --force", "force.csv");
}
