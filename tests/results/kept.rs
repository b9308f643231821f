//! A run kept in memory, when it is written, gives the same file as a run that was recorded to the file.

use std::error::Error;
use std::path::Path;
use stickslip::analysis::{KeptReport, Modes};
use stickslip::case::{Case, CaseSource, Override};
use stickslip::report::{ModesReport, Report};
use stickslip::results::{KeptRows, KeptView, Overwrite, ResultFile, Status};
use stickslip::{GivenCase, SavedRun, overrides};

type Outcome = Result<(), Box<dyn Error>>;

fn case(name: &str, settings: &[&str]) -> Result<Case, Box<dyn Error>> {
    let overrides = settings.iter().map(|setting| Override::parse(setting));
    Ok(Case::read(
        &CaseSource::built_in(name)?,
        &overrides.collect::<Result<Vec<_>, _>>()?,
    )?)
}

fn kept(case: &Case, witness: bool, trajectory: bool) -> KeptReport {
    KeptReport::of_run(case, &case.resolved(), witness, trajectory, &())
}

fn view(rows: &KeptRows) -> KeptView<'_> {
    KeptView {
        tables: rows
            .tables
            .iter()
            .map(|table| table.columns.iter().map(|column| column.values.view()).collect())
            .collect(),
        order: &rows.order,
    }
}

fn recorded(case: &Case, path: &Path) -> Outcome {
    assert!(SavedRun::new(case, path).start()?.unsaved.is_none());
    Ok(())
}

fn differences(a: &Path, b: &Path) -> Result<usize, Box<dyn Error>> {
    let (a, b) = (std::fs::read(a)?, std::fs::read(b)?);
    assert_eq!(a.len(), b.len());
    Ok(a.iter().zip(&b).filter(|(a, b)| a != b).count())
}

/// A brake and a system in the general form, whose states differ, with pieces of dense output between the samples.
#[test]
fn results_kept_rows_make_the_same_file() -> Outcome {
    for (name, settings) in [
        ("paper-si", &[][..]),
        ("paper-si", &["output.dense=true", "output.end_time=0.05"]),
        ("belt-leine", &["output.end_time=30", "output.dense=true"]),
    ] {
        let folder = tempfile::tempdir()?;
        let case = case(name, settings)?;
        let (kept_file, recorded_file) = (folder.path().join("kept.h5"), folder.path().join("recorded.h5"));
        let kept = kept(&case, false, true);
        assert_eq!(kept.run.status, Status::Complete);
        kept.write(&kept_file, Overwrite::OwnResults, &view(&kept.rows))?;
        recorded(&case, &recorded_file)?;
        // Only texts of constant length may differ: the second of the start in /meta and `history`, the wall time,
        // and the checksum of the attributes that contain them.
        let differing = differences(&kept_file, &recorded_file)?;
        assert!(differing <= 64, "{name}: {differing} bytes differ");
        assert!(stickslip::results::check(&kept_file)?.problems.is_empty());
    }
    Ok(())
}

/// If /events is viewed with the column of the witness after the recorded ones, as in the file, that file is written.
#[test]
fn results_the_column_of_a_witness_is_written_once() -> Outcome {
    let folder = tempfile::tempdir()?;
    let case = case("paper-si", &[])?;
    let kept = kept(&case, true, true);
    let column = kept.run.witness.as_ref().ok_or("no witness")?.column();
    let files = ["alone.h5", "shown.h5"].map(|name| folder.path().join(name));
    let mut rows = view(&kept.rows);
    kept.write(&files[0], Overwrite::OwnResults, &rows)?;
    rows.tables[1].push(column.values.view());
    kept.write(&files[1], Overwrite::OwnResults, &rows)?;
    assert_eq!(differences(&files[0], &files[1])?, 0);
    let file = ResultFile::open(&files[1])?;
    assert_eq!(file.typed_column("events", "witness_time")?, column.values);
    Ok(())
}

/// Each column has the type that it has in memory. The attributes of /stick_slip are the same, too.
#[test]
fn results_typed_columns_are_those_of_memory() -> Outcome {
    let folder = tempfile::tempdir()?;
    let path = folder.path().join("kept.h5");
    let case = case("paper-si", &["output.dense=true", "output.end_time=0.05"])?;
    let kept = kept(&case, false, true);
    kept.write(&path, Overwrite::OwnResults, &view(&kept.rows))?;
    let file = ResultFile::open(&path)?;
    for table in &kept.rows.tables {
        for column in &table.columns {
            let name = &column.variable.name;
            assert_eq!(file.typed_column(table.group, name)?, column.values, "{name}");
        }
    }
    let names: Vec<String> = file.tables()?.into_iter().map(|(group, _)| group).collect();
    for group in "trajectory events segments stick_slip dense dense/coefficients".split(' ') {
        assert!(names.iter().any(|name| name == group), "{group} is not among {names:?}");
    }
    Ok(())
}

#[test]
fn property_events_alone_are_the_same_events() -> Outcome {
    let mut case = case("paper-si", &[])?;
    let whole = kept(&case, false, true);
    case.without_trajectory();
    let events = kept(&case, false, false);
    assert_eq!(events.rows.tables[0].rows(), 0);
    assert_eq!(events.rows.tables[1].columns, whole.rows.tables[1].columns);
    Ok(())
}

#[test]
fn property_a_kept_run_ends_when_it_is_told_to() -> Outcome {
    let case = case("paper-si", &[])?;
    let kept = KeptReport::of_run(&case, "", false, true, &|| true);
    assert_eq!(kept.run.status, Status::Interrupted);
    Ok(())
}

#[test]
fn property_a_report_gives_text_and_document() -> Outcome {
    let given = GivenCase::read("paper")?;
    let changes = overrides(&["friction.decay=4".to_owned()])?;
    let case = Case::read(&given.source, &changes)?;
    let modes = Modes::of_case(&case.system, &case.solver, case.output.end_time);
    let report = ModesReport::new(&given, &changes, &case, &modes);
    assert!(report.text().contains("natural period T_n"));
    let document: serde_json::Value = serde_json::from_str(&report.document()?)?;
    assert_eq!(document["case"], "built-in case paper");
    assert_eq!(document["changed"], serde_json::json!(["friction.decay = 4 s/rad"]));
    assert!(document["natural_period"].is_number());
    Ok(())
}
