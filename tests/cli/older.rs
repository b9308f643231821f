//! Files of earlier versions: a channel that was added since follows from the columns that they have.
//!
//! `paper.0.1.0.h5.gz` is of version 0.1.0 as it was first released (c2ada2c4): `stickslip run paper --set output.interval=0.25
//! --set 'output.window=[{from=6.9895,to=6.9897,interval=5e-5}]'`. `belt.0.2.0.h5.gz` is of the last build before `contact_power`
//! (69d6f0f2), with dense output: `stickslip run belt-leine --set output.end_time=11 --set output.interval=0.25 --set
//! output.around=none --set output.dense=true --no-witness`.

use crate::common::cli::Folder;
use crate::common::json::*;
use std::io::Read as _;
use stickslip::results::{EventSide, ResultFile};

/// File, command that repeats its run, and events of its sequence.
const FILES: [(&str, &str, usize); 2] = [
    (
        "paper.0.1.0.h5",
        "run paper --set output.interval=0.25 --set output.window=[{from=6.9895,to=6.9897,interval=5e-5}]",
        95,
    ),
    (
        "belt.0.2.0.h5",
        "run belt-leine --set output.end_time=11 --set output.interval=0.25 --set output.around=none",
        2,
    ),
];

/// A folder with the file.
fn folder_with(name: &str) -> (Folder, ResultFile) {
    let folder = Folder::new();
    let packed = std::fs::read(format!("{}/tests/data/{name}.gz", env!("CARGO_MANIFEST_DIR"))).unwrap();
    let mut bytes = Vec::new();
    flate2::read::GzDecoder::new(&packed[..])
        .read_to_end(&mut bytes)
        .unwrap();
    let path = folder.write(name, bytes);
    let file = ResultFile::open(&path).unwrap();
    (folder, file)
}

/// The product of its factors, by every way to read it; in stick it is a positive zero.
#[test]
fn analytic_a_channel_that_an_older_file_lacks_is_the_product_of_its_factors() {
    for (name, ..) in FILES {
        let (_folder, file) = folder_with(name);
        let held = file.contents().unwrap().variables;
        assert!(!held.iter().any(|variable| variable.name.ends_with("contact_power")));
        let rows = 0..file.sample_count().unwrap();
        let column = |name: &str| file.column(name, rows.clone()).unwrap();
        let (torque, velocity, power) = (
            column("friction_torque"),
            column("relative_velocity"),
            column("contact_power"),
        );
        let pairs = torque.iter().zip(&velocity);
        let products: Vec<f64> = pairs.map(|(torque, velocity)| torque * velocity).collect();
        assert_eq!(power, products);
        assert!(power.iter().any(|power| *power > 0.0), "{name}");
        assert!(power.iter().all(|power| power.is_sign_positive()), "{name}");
        let samples = file.finite_samples(rows.clone()).unwrap();
        assert!(samples.iter().map(|sample| sample.channels.contact_power).eq(products));
        let columns = file.table("trajectory").unwrap();
        let place = columns
            .iter()
            .position(|column| column.name == "contact_power")
            .unwrap();
        assert_eq!(columns[place - 1].name, "energy_residual");
        let values = file.table_values("trajectory", "contact_power", rows.clone()).unwrap();
        assert_eq!((columns[place].units.as_str(), values.len()), ("W", rows.end));
        if let Some(dense) = file.dense().unwrap() {
            let times = [7.3, 10.9];
            let value = |name: &str| dense.values(name, &times, EventSide::Before).unwrap();
            let (torque, velocity) = (value("friction_torque"), value("relative_velocity"));
            assert_eq!(value("contact_power"), [torque[0] * velocity[0], 0.0]);
        }
    }
}

/// Whatever else reads a result reads theirs.
#[test]
fn cli_every_command_reads_older_files() {
    for (name, again, events) in FILES {
        let (folder, _) = folder_with(name);
        assert!(folder.ok(&["inspect", name, "-v"]).contains("dissipated_friction"));
        assert!(folder.ok(&["check", name]).contains("complete"));
        folder.ok(&["plot", name, "-o", "figures", "--channel", "contact_power"]);
        folder.ok(&["plot", name, "--html", "page.html"]);
        let stem = name.trim_end_matches(".h5");
        let figure = format!("figures/{stem}-channel-contact-power.svg");
        assert!(folder.path(&figure).exists(), "{figure}");
        assert!(
            String::from_utf8(folder.read("page.html"))
                .unwrap()
                .contains("\"contact_power\"")
        );
        folder.ok(&["export", name, "-o", "all.csv"]);
        let text = folder.text("all.csv");
        assert!(text.lines().next().unwrap().contains(",contact_power [W]"));
        folder.ok(&format!(
            "export {name} -o at.csv --interval 0.1 --channels contact_power"
        ));
        assert!(folder.read("at.csv").starts_with(b"time [s],contact_power [W]"));
        // The present program has the events of the older one.
        folder.ok(&format!("{again} -q --no-witness -o now.h5"));
        for pair in [[name, "now.h5"], ["now.h5", name]] {
            let report = folder.json(&["compare", pair[0], pair[1], "--quick", "--require", "events<1e-9"]);
            let found = &report["comparisons"][0];
            let channels = found["channels"].list();
            let has_power = channels.iter().any(|channel| channel["channel"] == "contact_power");
            assert!(has_power, "{found}");
            assert_eq!(found["event_errors"]["matched"], events);
        }
    }
}
