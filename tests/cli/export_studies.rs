//! Tables of studies: a row for each point.

use crate::common::cli::Folder;

fn lines(folder: &Folder, name: &str) -> Vec<Vec<String>> {
    let text = folder.text(name);
    let cells = |line: &str| line.split(',').map(str::to_owned).collect();
    text.lines().map(cells).collect()
}

/// The table of a grid has each point with its axes and its quantities, as the file has them.
#[test]
fn cli_export_of_a_sweep_has_a_row_for_each_point() {
    let folder = Folder::new();
    folder.write("map.toml", crate::sweep::QUICK);
    folder.ok("sweep map.toml -q");
    assert!(folder.ok("export map.h5").contains("map.csv"));
    let table = lines(&folder, "map.csv");
    let file = folder.sweep_file("map.h5");
    let place = |name: &str| {
        let found = table[0].iter().position(|cell| cell.split(" [").next() == Some(name));
        found.unwrap_or_else(|| panic!("{name} of {:?}", table[0]))
    };
    assert_eq!((table.len(), table[0][0].as_str()), (37, "point"));
    assert!(
        table[0].contains(&"torsion_damping [N m s/rad]".to_owned()),
        "{:?}",
        table[0]
    );
    let (damping, method, status) = (place("torsion_damping"), place("solver_method"), place("status"));
    let levels = file.numbers("torsion_damping").unwrap();
    let ends = file.numbers("end_time").unwrap();
    for (point, row) in table[1..].iter().enumerate() {
        assert_eq!(row[0], point.to_string());
        assert_eq!(row[damping].parse::<f64>().unwrap(), levels[point / 6]);
        assert_eq!(row[method], ["arkode", "erk"][point % 2]);
        let failed = row[status] == "failed";
        assert_eq!(failed, ends[point].is_nan(), "{row:?}");
        let end = row[place("end_time")].parse::<f64>().unwrap();
        assert!(end == ends[point] || failed && end.is_nan(), "{row:?}");
    }
    // Chosen columns, other formats, and what a study has not.
    folder.ok("export map.h5 -o two.csv --channels torsion_damping,end_time");
    assert_eq!(lines(&folder, "two.csv")[0].len(), 2);
    folder.ok("export map.h5 --format npz");
    folder.ok("export map.h5 -o map.mat");
    assert!(folder.read("map.npz").starts_with(b"PK"));
    folder.refused("export map.h5 -o x.csv --channels torsion", "torsion & there are point");
    folder.refused("export map.h5 -o x.csv --rate 100", "map.h5 & no times & --rate");
    folder.refused("export map.h5 -o x.csv --table events", "--table");
}

/// Branches have the columns of /points, with words for codes.
#[test]
fn cli_export_of_branches_has_a_row_for_each_point() {
    let folder = crate::plot_branches::with_branches();
    folder.ok("export belt.h5");
    let table = lines(&folder, "belt.csv");
    let file =
        stickslip::results::StudyFile::open(&folder.path("belt.h5"), stickslip::results::schema::CONTINUATION_FORMAT)
            .unwrap();
    let periods = file.numbers("points/period").unwrap();
    assert_eq!(table.len(), periods.len() + 1);
    let place = |name: &str| {
        table[0]
            .iter()
            .position(|cell| cell.split(" [").next() == Some(name))
            .unwrap()
    };
    for (row, period) in table[1..].iter().zip(&periods) {
        let found = row[place("period")].parse::<f64>().unwrap();
        assert!(found == *period || found.is_nan() && period.is_nan(), "{row:?}");
        assert!(
            ["stable", "unstable", "neutral"].contains(&row[place("stability")].as_str()),
            "{row:?}"
        );
    }
}

/// `export` and `case` name their files themselves, or as asked; an existing case is not replaced.
#[test]
fn cli_files_without_a_name_are_named_after_their_source() {
    let folder = Folder::new();
    folder.ok_short("-q -o a.h5");
    folder.ok("export a.h5");
    folder.ok("export a.h5 --table events --format npz");
    assert_eq!(folder.names(), ["a-events.npz", "a.csv", "a.h5"]);
    folder.ok("case paper -o my.toml");
    assert_eq!(folder.text("my.toml"), folder.ok("case paper"));
    folder.refused("case paper-si -o my.toml", "my.toml & is there already & -o & --force");
    folder.ok("case paper-si -o my.toml --force");
    assert_eq!(folder.text("my.toml"), folder.ok("case paper-si"));
    folder.refused("run -o x.csv", "x.csv & give -o x.h5 & stickslip export x.h5 -o x.csv");
    folder.refused("run -o x.parquet", "x.parquet & give -o x.h5 & stickslip export x.h5");
}
