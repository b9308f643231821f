//! Makes pictures of the documentation, into docs/figures: `cargo run --release --example gallery`, in a checkout.
//!
//! Figures of the paper's brake, the onset of `paper-si` against the tolerance, and the figure of the built-in
//! work-precision study, which takes some minutes and whose times are those of the machine. The pictures of
//! docs/2-your-case.md and docs/4-many-runs.md are made by the commands on these pages.

use std::error::Error;
use std::path::Path;
use stickslip::analysis::stability::growth::onsets;
use stickslip::analysis::work_precision::{self, PrecisionStudy, StudySource};
use stickslip::case::{Case, CaseSource};
use stickslip::output::{Output, Product};
use stickslip::plot::catalogue;
use stickslip::plot::entry::Subject;
use stickslip::plot::style::COLUMN_WIDTH;
use stickslip::plot::{self, Drawing, DrawnRun, Figure};
use stickslip::results::schema::Extension;
use stickslip::results::{Header, Overwrite, ResultWriter, Status, StickSlipTable};

const FIRST: &str = "stick-slip-transition";

fn main() -> Result<(), Box<dyn Error>> {
    let case = Case::read(&CaseSource::built_in("paper")?, &[])?;
    let path = Path::new("target").join("gallery.h5");
    let header = Header {
        title: case.title.clone(),
        source: "examples/gallery.rs".to_owned(),
        references: String::new(),
        history: String::new(),
        case_text: case.resolved(),
        resolved: case.resolved(),
        events: Vec::new(),
        meta: Vec::new(),
        asked: None,
        changed: Vec::new(),
        extension: Extension::default(),
    };
    let mut writer = ResultWriter::create(&path, Overwrite::OwnResults, &[], &header)?;
    let report = stickslip::Run::new(&case).record(&mut writer).start()?;
    writer.finish(Status::Complete, &StickSlipTable::default(), 0.0)?;
    println!("{} sticks", report.digest.cycles.stick_count);
    let runs = [DrawnRun::open(&path)?];
    let subject = Subject::new(&runs).ok_or("no run")?;
    for entry in [FIRST, "stick-slip-close-up", "durations"] {
        let figure = catalogue::find(entry)?.build(&subject)?.map_err(|absent| absent.why)?;
        save(&figure)?;
        // The first picture of the README has a form for dark pages.
        if figure.name == FIRST {
            let drawing = plot::draw(&figure, COLUMN_WIDTH).on_dark();
            write(&format!("{}-dark", figure.name), &drawing)?;
        }
    }
    let kicked = Case::read(&CaseSource::built_in("paper-si")?, &[])?;
    let system = kicked.system.clone();
    let found = onsets(&system, &kicked.solver, kicked.output.end_time, &|| false).ok_or("interrupted")?;
    save(&plot::accuracy::onset_figure(&kicked.title, &found))?;
    let study = PrecisionStudy::parse(StudySource::find("work-precision", work_precision::STUDIES)?)?;
    let result = work_precision::run(&study, &())?;
    save(&plot::accuracy::work_precision_figure(&study.head.title, &result))
}

fn save(figure: &Figure) -> Result<(), Box<dyn Error>> {
    write(&figure.name, &plot::draw(figure, COLUMN_WIDTH))
}

fn write(name: &str, drawing: &Drawing) -> Result<(), Box<dyn Error>> {
    let path = Path::new("docs/figures").join(format!("{name}.svg"));
    let output = Output::new(&path, Product::Figure("-o"), &[], false)?;
    output.write(&[drawing.svg().as_bytes()])?;
    println!("{}", path.display());
    Ok(())
}
