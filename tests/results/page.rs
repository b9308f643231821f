//! The interactive page contains the data of the result file: its decoded arrays against the file's columns.

use crate::common::cases::parsed;
use crate::common::cli::says;
use crate::common::json::*;
use crate::common::unlocked;
use std::path::{Path, PathBuf};

use crate::common::page::{Page, assert_decoded, codes, doubles};
use crate::common::results::{header, record, stick_slip, write};
use stickslip::Run;
use stickslip::case::{Case, CaseSource};
use stickslip::plot::page::{self, SIZE_LIMIT, SIZE_LIMIT_OF_TWO};
use stickslip::record::EventKind;
use stickslip::results::{Header, Overwrite, ResultFile, ResultWriter, Status, partial_path};
use tempfile::TempDir;

/// The page of a result file, beside it.
fn page_of(path: &Path) -> (ResultFile, page::RunPage, Page) {
    let file = ResultFile::open(path).unwrap();
    let target = path.with_extension("html");
    let made = page::write(&file, None, &target, false).unwrap();
    assert_eq!(std::fs::metadata(&target).unwrap().len(), made.bytes);
    (file, made, Page::read(&target))
}

fn run(folder: &TempDir, overrides: &[&str]) -> PathBuf {
    let source = CaseSource::built_in("paper").unwrap();
    let overrides = parsed(overrides);
    let case = Case::read(&source, &overrides).unwrap();
    let path = folder.path().join("paper.h5");
    let header = Header {
        title: case.title.clone(),
        case_text: source.text.clone(),
        resolved: case.resolved(),
        ..header()
    };
    let mut writer = ResultWriter::create(&path, Overwrite::OwnResults, &[], &header).unwrap();
    Run::new(&case).record(&mut writer).start().unwrap();
    writer.finish(Status::Complete, &stick_slip(), 1.0).unwrap()
}

fn least(values: &[f64]) -> f64 {
    values.iter().copied().fold(f64::NAN, f64::min)
}

fn most(values: &[f64]) -> f64 {
    values.iter().copied().fold(f64::NAN, f64::max)
}

/// Compares every entry of the page with the rows of the file for which it stands. Returns which rows are unchanged.
fn assert_holds(file: &ResultFile, page: &Page) -> Vec<bool> {
    let rows = file.sample_count().unwrap();
    let times = file.column("time", 0..rows).unwrap();
    let entries = page.entries(&times);
    let mut kept = vec![false; rows];
    let mut next = 0;
    for (range, bucket) in &entries {
        assert_eq!(range.start, next, "no row is left out or taken twice");
        next = range.end;
        assert!(*bucket || range.len() == 1);
        kept[range.start] = !bucket;
    }
    assert_eq!(next, rows);
    let ends: Vec<f64> = entries.iter().filter(|e| e.1).map(|e| times[e.0.end - 1]).collect();
    assert_eq!(doubles(&page.trajectory["bucket_end"]), ends);
    for name in page.channel_names() {
        let stored = file.column(&name, 0..rows).unwrap();
        let (low, high) = page.channel(&name);
        let lows: Vec<f64> = entries.iter().map(|e| least(&stored[e.0.clone()])).collect();
        let values = entries.iter().filter(|e| e.1).map(|e| most(&stored[e.0.clone()]));
        let highs: Vec<f64> = values.collect();
        assert_decoded(&name, &low, &lows, page.block());
        assert_decoded(&name, &high, &highs, page.block());
    }
    kept
}

#[test]
fn results_a_run_that_fits_is_there_sample_by_sample() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("made-up.h5");
    write(&path, 9_000);
    let (file, made, page) = page_of(&path);
    assert_eq!((made.samples, made.samples_kept), (9_000, 9_000));
    assert!(assert_holds(&file, &page).iter().all(|kept| *kept));
    let bits = |values: Vec<f64>| values.into_iter().map(f64::to_bits).collect::<Vec<_>>();
    assert_eq!(bits(page.times()), bits(file.column("time", 0..9_000).unwrap()));
    // NaN and infinite values of the made-up run are stored unchanged.
    assert!(page.channel("z").0[3].is_nan());
    assert_eq!(page.channel("normal_force").0[5], f64::INFINITY);
}

#[test]
fn results_events_are_exact() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("made-up.h5");
    write(&path, 9_000);
    let (file, _, page) = page_of(&path);
    let (events, shown) = (file.events().unwrap(), &page.run["events"]);
    assert_eq!(shown["count"], 90);
    let found = doubles(&shown["time"]);
    assert_eq!(found, events.iter().map(|e| e.time).collect::<Vec<_>>());
    let found = codes(&shown["kind"]);
    assert_eq!(found, events.iter().map(|e| e.kind.code()).collect::<Vec<_>>());
    let found = codes(&shown["mode_after"]);
    assert_eq!(found, events.iter().map(|e| e.mode_after.code()).collect::<Vec<_>>());
    for state in shown["states"].list() {
        if state["name"] == "relative_velocity" {
            let velocity: Vec<f64> = events.iter().map(|e| e.after.relative_velocity).collect();
            assert_eq!(doubles(&state["after"]), velocity);
        }
    }
    assert_eq!(shown["states"].list().len(), 9);
}

/// In stick the relative velocity is exactly 0, and within a cycle energies change by millionths of their values.
/// Both are visible after the encoding.
#[test]
fn results_stick_and_energies_keep_their_digits() {
    let folder = tempfile::tempdir().unwrap();
    let (file, _, page) = page_of(&run(&folder, &[]));
    let rows = file.sample_count().unwrap();
    assert!(assert_holds(&file, &page).iter().all(|kept| *kept));
    let modes = file.column("mode", 0..rows).unwrap();
    let (velocity, _) = page.channel("relative_velocity");
    let stored = file.column("relative_velocity", 0..rows).unwrap();
    let sticking = (0..rows).filter(|&row| modes[row] == 1.0 && stored[row] == 0.0);
    assert!(sticking.inspect(|&row| assert_eq!(velocity[row], 0.0)).count() > 1_000);
    let (lost, stored) = (
        page.channel("dissipated_friction").0,
        file.column("dissipated_friction", 0..rows).unwrap(),
    );
    let times = page.times();
    for row in (0..rows).filter(|&row| (6.9755..6.989).contains(&times[row])) {
        // 128 samples take 320 us, in which friction dissipates some 4 mJ of the 11 kJ.
        let error = (lost[row] - stored[row]).abs();
        assert!(error < 5e-9, "{} J at {} s", lost[row] - stored[row], times[row]);
    }
    // All of this takes little more than half of the available space.
    assert!(page.html.len() < SIZE_LIMIT * 3 / 5);
}

/// 113,000 samples: those of the stick-slip are stored unchanged, and of the rest the extremes.
#[test]
fn results_a_long_run_keeps_extremes_and_the_samples_near_events() {
    let folder = tempfile::tempdir().unwrap();
    let (file, made, page) = page_of(&run(&folder, &["output.interval=1e-4"]));
    assert!(made.samples > 100_000, "{made:?}");
    assert!(made.samples_kept < made.samples / 2, "{made:?}");
    assert!(page.html.len() < SIZE_LIMIT);
    // The available space is used.
    assert!(page.html.len() > SIZE_LIMIT * 8 / 10, "{}", page.html.len());
    let kept = assert_holds(&file, &page);
    assert_eq!(kept.iter().filter(|kept| **kept).count(), made.samples_kept);
    let times = file.column("time", 0..made.samples).unwrap();
    for event in file.events().unwrap() {
        let row = times.partition_point(|&t| t < event.time);
        assert!(
            kept[row - 100..row + 100].iter().all(|kept| *kept),
            "near {} s",
            event.time
        );
    }
    // From the first to the last stick there are no bands.
    let window = times.partition_point(|&t| t < 6.9749)..times.partition_point(|&t| t < 6.9895);
    assert!(kept[window].iter().all(|kept| *kept));
    let note = page.trajectory["notes"][0].text();
    assert!(note.contains(&made.samples_kept.to_string()), "{note}");
    assert!(note.contains("drawn as a band"), "{note}");
}

/// 3,000 events in 300,000 samples need more than the available space, and the page says so.
#[test]
fn results_more_events_than_fit_are_counted() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("made-up.h5");
    write(&path, 300_000);
    let (file, made, page) = page_of(&path);
    assert!(page.html.len() < SIZE_LIMIT);
    assert!(made.samples_kept > 10_000, "{made:?}");
    assert_holds(&file, &page);
    let notes = page.trajectory["notes"].to_string();
    assert!(notes.contains("of 3000 events"), "{notes}");
}

/// Of 6,000 events 5,000 are listed.
#[test]
fn results_a_list_that_is_cut_says_so() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("made-up.h5");
    let mut writer = ResultWriter::create(&path, Overwrite::OwnResults, &[], &header()).unwrap();
    record(&mut writer, 1_000).unwrap();
    for number in 10..6_000 {
        stickslip::record::Recorder::event(&mut writer, &crate::common::results::event(number)).unwrap();
    }
    writer.finish(Status::Complete, &stick_slip(), 1.0).unwrap();
    let (_, _, page) = page_of(&path);
    assert!(page.html.len() < SIZE_LIMIT);
    assert_eq!(doubles(&page.run["events"]["time"]).len(), 5_000);
    assert!(page.run["notes"].to_string().contains("first 5000 of 6000 events"));
}

/// /events has no column for the torque at which the interface breaks away. It is T_f, r times the internal force.
#[test]
fn results_torques_of_a_brake_are_there_on_both_sides_of_events() {
    let folder = tempfile::tempdir().unwrap();
    let (file, _, page) = page_of(&run(&folder, &[]));
    let side = |name: &str, side: &str| {
        let states = page.run["events"]["states"].list();
        let state = states
            .iter()
            .find(|state| state["name"] == name)
            .expect("a channel at events");
        doubles(&state[side])
    };
    let (transmitted, friction) = (side("transmitted_torque", "after"), side("friction_torque", "after"));
    let before = side("friction_torque", "before");
    // 2.0625 in.
    let radius = 2.0625 * 0.0254;
    let events = file.events().unwrap();
    let mut sticks = 0;
    for (k, event) in events.iter().enumerate() {
        let held = event.internal_force * radius;
        // Both are sums of the same products in another order, of torques up to 110 N m. A kick on both surfaces
        // changes the torque, and the file has its value before the kick.
        if event.kind != EventKind::Kick {
            assert!((transmitted[k] - held).abs() < 1e-9, "{} for {held}", transmitted[k]);
        }
        if event.kind == EventKind::Stick {
            sticks += 1;
            assert_eq!(friction[k], transmitted[k]);
            // Sliding ends at mu_s r F_n = 0.6 x 0.0523875 m x 2224.1 N = 69.9 N m. F_n still rings by 1e-4 of
            // itself.
            assert!((before[k] - 69.91).abs() < 0.02, "{}", before[k]);
        }
    }
    assert!(sticks > 40);
}

/// With 15 samples for 94 stretches, the stretches are named, with a command that helps. The case as it is has
/// enough.
#[test]
fn results_stretches_with_too_few_samples_are_marked() {
    let folder = tempfile::tempdir().unwrap();
    let (_, _, page) = page_of(&run(&folder, &[]));
    assert!(doubles(&page.run["sparse"]["from"]).is_empty());
    assert!(page.run["remedy"].is_null());
    std::fs::remove_file(folder.path().join("paper.html")).unwrap();
    let (file, _, page) = page_of(&run(
        &folder,
        &["output.window=[]", "output.around=none", "output.interval=1e-3"],
    ));
    let (from, to) = (doubles(&page.run["sparse"]["from"]), doubles(&page.run["sparse"]["to"]));
    assert!(from.len() > 80 && from.len() == to.len(), "{}", from.len());
    assert!(from.iter().zip(&to).all(|(from, to)| from < to) && from.is_sorted());
    // The first one is the growth of the oscillation, from the loss of stability on.
    let events = file.events().unwrap();
    let of = |kind: EventKind| events.iter().find(|event| event.kind == kind).unwrap().time;
    assert!(from[0] >= of(EventKind::Destabilised) && to[0] == of(EventKind::Stick));
    let remedy = page.run["remedy"].text();
    says(remedy, &["stickslip run paper.h5", "output.window=[{from=6.9"]);
}

/// The page of two runs has the columns of both, their difference at the first one's samples, and pairs of events.
#[test]
fn results_two_runs_are_on_one_page_with_their_difference() {
    let folder = tempfile::tempdir().unwrap();
    let first = folder.path().join("first.h5");
    std::fs::rename(run(&folder, &[]), &first).unwrap();
    let second = run(&folder, &["friction.decay=4.99"]);
    let (first, second) = (ResultFile::open(&first).unwrap(), ResultFile::open(&second).unwrap());
    let target = folder.path().join("pair.html");
    let made = page::write(&first, Some(&second), &target, false).unwrap();
    assert!(made.bytes < SIZE_LIMIT_OF_TWO as u64);
    assert_eq!(made.samples, made.samples_kept);
    let page = Page::read(&target);
    let times = first.column("time", 0..made.samples).unwrap();
    let rows = second.sample_count().unwrap();
    let other_times = second.column("time", 0..rows).unwrap();
    for name in ["relative_velocity", "phi1", "transmitted_torque"] {
        let (difference, _) = page.channel(&format!("difference_of_{name}"));
        let (ours, theirs) = (
            first.column(name, 0..made.samples).unwrap(),
            second.column(name, 0..rows).unwrap(),
        );
        let expected: Vec<f64> = difference
            .iter()
            .enumerate()
            .map(
                |(k, shown)| match other_times.binary_search_by(|t| t.total_cmp(&times[k])) {
                    Ok(row) => ours[k] - theirs[row],
                    // Between two samples of the second run the value is on a straight line.
                    Err(_) => *shown,
                },
            )
            .collect();
        assert!(expected.iter().any(|difference| difference.abs() > 0.0));
        assert_decoded(name, &difference, &expected, page.block());
    }
    assert!(page.run["title"].text().ends_with(": first.h5 and paper.h5"));
    let note = page.trajectory["notes"].to_string();
    assert!(note.contains("first run less the second"), "{note}");
    let other = &page.run["second"];
    assert_eq!(doubles(&other["trajectory"]["time"]), other_times);
    let (ours, theirs) = (first.events().unwrap(), second.events().unwrap());
    let pairs = other["pairs"].list();
    let indices = |pair: &serde_json::Value| (pair[0].whole() as usize, pair[1].whole() as usize);
    for (k, m) in pairs.iter().map(indices) {
        assert_eq!(ours[k].kind, theirs[m].kind);
    }
    // Every first stick has a partner, which is earlier or later by a fraction of a natural period.
    let stick = |events: &[stickslip::record::Event]| events.iter().position(|e| e.kind == EventKind::Stick).unwrap();
    assert!(
        pairs
            .iter()
            .map(indices)
            .any(|pair| pair == (stick(&ours), stick(&theirs)))
    );
    assert!(pairs.len() * 10 > ours.len() * 8, "{} of {}", pairs.len(), ours.len());
}

/// Each run with too few samples has its own command. One with enough samples has none; the page once called it
/// "null".
#[test]
fn results_a_second_run_with_too_few_samples_has_its_own_remedy() {
    let folder = tempfile::tempdir().unwrap();
    let first = folder.path().join("first.h5");
    std::fs::rename(run(&folder, &[]), &first).unwrap();
    let second = run(
        &folder,
        &["output.window=[]", "output.around=none", "output.interval=1e-3"],
    );
    let (first, second) = (ResultFile::open(&first).unwrap(), ResultFile::open(&second).unwrap());
    let target = folder.path().join("pair.html");
    page::write(&first, Some(&second), &target, false).unwrap();
    let page = Page::read(&target);
    assert!(page.run["remedy"].is_null());
    says(page.run["second"]["remedy"].text(), "stickslip run paper.h5");
    let text = std::fs::read_to_string(&target).unwrap();
    assert!(!text.contains("${run.remedy}"));
}

#[test]
fn results_shaded_modes_are_those_of_the_segments() {
    let folder = tempfile::tempdir().unwrap();
    let (file, _, page) = page_of(&run(&folder, &[]));
    let (starts, modes) = (doubles(&page.run["modes"]["start"]), codes(&page.run["modes"]["code"]));
    assert!(modes.windows(2).all(|pair| pair[0] != pair[1]));
    for segment in file.segments().unwrap().iter().filter(|s| s.end > s.start) {
        let middle = (segment.start + segment.end) / 2.0;
        let shade = modes[starts.partition_point(|&start| start <= middle) - 1];
        assert_eq!(shade, segment.mode.code(), "at {middle} s");
    }
}

#[test]
fn results_the_paper_stands_beside_its_own_case_only() {
    let folder = tempfile::tempdir().unwrap();
    let (_, _, page) = page_of(&run(&folder, &[]));
    assert_eq!(page.run["beside_paper"], true);
    let as_array = page.run["headline"].list();
    let row = as_array.iter().find(|row| row["name"] == "onset of stick-slip");
    assert_eq!(row.unwrap()["value"], "6.975001494 s");
    assert_eq!(row.unwrap()["paper"], "6.975 s");
    let path = folder.path().join("made-up.h5");
    write(&path, 100);
    assert_eq!(page_of(&path).2.run["beside_paper"], false);
    let changed = run(&folder, &["friction.decay=4.9", "output.end_time=0.1"]);
    assert_eq!(page_of(&changed).2.run["beside_paper"], false);
}

#[test]
fn results_markup_in_texts_is_escaped() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("odd.h5");
    let odd = "</title></script><script>alert(\"1\")</script><!-- <b>&amp; 'x'";
    let header = Header {
        title: odd.to_owned(),
        case_text: format!("title = '''{odd}'''"),
        resolved: odd.to_owned(),
        history: odd.to_owned(),
        ..header()
    };
    let mut writer = ResultWriter::create(&path, Overwrite::OwnResults, &[], &header).unwrap();
    record(&mut writer, 100).unwrap();
    writer
        .finish(Status::Failed(odd.to_owned()), &stick_slip(), 1.0)
        .unwrap();
    let (_, _, page) = page_of(&partial_path(&path));
    assert!(!page.html.contains("alert(\"1\")</script>") && !page.html.contains("<!--") && !page.html.contains("<b>"));
    assert_eq!(page.html.matches("<script").count(), 3);
    assert_eq!(page.html.matches("</script").count(), 3);
    assert_eq!(page.html.matches("</title").count(), 1);
    assert!(
        page.html
            .contains("<title>&lt;/title&gt;&lt;/script&gt;&lt;script&gt;alert")
    );
    assert_eq!(page.run["title"], odd);
    assert_eq!(page.run["resolved"], odd);
    assert!(page.run["notice"].text().contains(odd));
}

#[test]
fn results_the_page_stands_alone() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("made-up.h5");
    write(&path, 100);
    let html = page_of(&path).2.html;
    for outside in ["src=", "href=", "@import", "url(", "fetch(", "import "] {
        assert!(!html.contains(outside), "{outside}");
    }
    assert!(html.contains("default-src 'none'"));
    let addresses: Vec<_> = html.match_indices("http").map(|(at, _)| &html[at..at + 26]).collect();
    // An attribute, and the name of the SVG namespace, which no browser opens.
    assert!(
        addresses
            .iter()
            .all(|a| a.starts_with("http-equiv") || *a == "http://www.w3.org/2000/svg"),
        "{addresses:?}"
    );
}

#[test]
fn results_an_unfinished_file_shows_what_it_has() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("made-up.h5");
    let mut writer = ResultWriter::create(&path, Overwrite::OwnResults, &[], &header()).unwrap();
    record(&mut writer, 5_050).unwrap();
    drop(writer);
    let (file, made, page) = page_of(&partial_path(&path));
    assert_eq!(made.samples, 5_050);
    assert!(assert_holds(&file, &page).iter().all(|kept| *kept));
    assert_eq!(page.run["status"], "interrupted");
    let notice = page.run["notice"].text();
    assert!(notice.contains("not complete"), "{notice}");
    assert!(notice.contains("up to t = 0.5049 s"), "{notice}");
    // The last segment was never written, so that its mode is that of the samples.
    let last = *codes(&page.run["modes"]["code"]).last().unwrap();
    assert_eq!(last, crate::common::results::sample(5_049).mode.code());

    let mut writer = ResultWriter::create(&path, Overwrite::OwnResults, &[], &header()).unwrap();
    record(&mut writer, 100).unwrap();
    let failed = Status::Failed("the step became too small at t = 0.01 s".to_owned());
    let partial = writer.finish(failed, &stick_slip(), 1.0).unwrap();
    let (_, _, page) = page_of(&partial);
    assert!(page.run["notice"].text().contains("failed: the step became too small"));
}

#[test]
fn results_a_file_without_samples_has_no_page() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("empty.h5");
    write(&path, 0);
    let file = ResultFile::open(&path).unwrap();
    let target = folder.path().join("empty.html");
    let error = page::write(&file, None, &target, false).unwrap_err();
    assert!(error.to_string().contains("empty.h5: has no trajectory"), "{error}");
    assert!(!target.exists());
}

#[test]
fn results_a_certificate_is_shown_where_there_is_one() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("certified.h5");
    write(&path, 100);
    assert!(page_of(&path).2.run["certificate"].is_null());
    let file = unlocked::open_rw(&path).unwrap();
    let group = file.create_group("certificate").unwrap();
    let verdict: hdf5::types::VarLenUnicode = "12 digits".parse().unwrap();
    group
        .new_attr::<hdf5::types::VarLenUnicode>()
        .create("verdict")
        .unwrap()
        .write_scalar(&verdict)
        .unwrap();
    group
        .new_attr::<f64>()
        .create("witnesses")
        .unwrap()
        .write_scalar(&3.0)
        .unwrap();
    group
        .new_attr::<f64>()
        .create("digits_of_double")
        .unwrap()
        .write_scalar(&14.0)
        .unwrap();
    let empty: hdf5::types::VarLenUnicode = "".parse().unwrap();
    group
        .new_attr::<hdf5::types::VarLenUnicode>()
        .create("remedy")
        .unwrap()
        .write_scalar(&empty)
        .unwrap();
    let rtols = group
        .new_dataset_builder()
        .with_data(&[1e-8, 1e-9, 1e-10])
        .create("rtol")
        .unwrap();
    let unit: hdf5::types::VarLenUnicode = "1".parse().unwrap();
    rtols
        .new_attr::<hdf5::types::VarLenUnicode>()
        .create("units")
        .unwrap()
        .write_scalar(&unit)
        .unwrap();
    drop((rtols, group, file));
    let page = page_of(&path).2;
    let certificate = &page.run["certificate"];
    // In words, without what is empty. A whole number has no decimal point.
    let expected = serde_json::json!([
        ["digits that double precision can hold", "14"],
        ["verdict", "12 digits"],
        ["witnesses", "3"]
    ]);
    assert_eq!(certificate["attributes"], expected);
    assert_eq!(certificate["columns"][0]["name"], "rtol");
    assert_eq!(doubles(&certificate["columns"][0]["values"]), [1e-8, 1e-9, 1e-10]);
}
