//! `stickslip plot`: draws figures and pages of files.

use super::arguments::{Common, DPI, FigureFormat, PlotOptions};
use super::{CommandEnd, complain, show, tell};
use crate::comparing::{MappingOptions, open_reference};
use crate::error::{Error, ErrorKind};
use crate::output::{Output, Product};
use crate::plot::branches::{self, Branches};
use crate::plot::catalogue::{self, ENTRIES, in_words_of};
use crate::plot::comparison::DrawnCandidate;
use crate::plot::entry::{CatalogueEntry, Subject};
use crate::plot::studies::{Choice, StudyColumn};
use crate::plot::{
    self, Drawing, DrawnRun, Figure, Layout, accuracy, certified, own, page, portraits, signature, studies, style,
};
use crate::report::{DistributionSummary, Page, PageTable, Report, distribution};
use serde::{Serialize, Serializer};
use std::path::{Path, PathBuf};
use stickslip_analysis::GivenCase;
use stickslip_analysis::analysis::advice::capitalised;
use stickslip_analysis::analysis::distribution::Distribution;
use stickslip_analysis::continuation::Stored;
use stickslip_case::Motion;
use stickslip_files::{Reason, ResultFile, Status, StudyFile, check_sound, schema};

const FIGURE: Product = Product::Figure("-o");

#[derive(Serialize)]
struct WrittenFigure {
    file: String,
    figure: String,
    title: String,
    paper_figure: Option<u32>,
}

#[derive(Serialize)]
struct PlotReport<'a> {
    files: Vec<WrittenFigure>,
    #[serde(flatten)]
    chosen: &'a Chosen,
    #[serde(skip)]
    inputs: &'a [PathBuf],
}

#[derive(Serialize)]
struct ListedFigure {
    figure: String,
    title: String,
    paper_figure: Option<u32>,
    of: &'static str,
}

pub(super) fn plot(options: &PlotOptions, common: &Common) -> Result<CommandEnd, Error> {
    if options.list {
        return list(options, common);
    }
    if let Some(path) = &options.html {
        return html(options, path, common);
    }
    if let Some(chosen) = of_many_runs(options)? {
        return finish(options, &chosen, &options.files, common);
    }
    if let Some(candidate) = &options.candidate {
        return beside(options, candidate, common);
    }
    let chosen = options.only.iter().map(|name| catalogue::find(name));
    let mut chosen: Vec<&CatalogueEntry> = chosen.collect::<Result<_, _>>()?;
    let mut names = std::collections::HashSet::new();
    chosen.retain(|entry| names.insert(entry.name));
    let runs = options.files.iter().map(|path| DrawnRun::open(path));
    let runs: Vec<DrawnRun> = runs.collect::<Result<_, _>>().map_err(no_run)?;
    one_kind(&runs)?;
    for run in runs.iter().filter(|_| !common.quiet) {
        tell_status(run);
    }
    let chosen = figures(options, &runs, &chosen)?;
    finish(options, &chosen, &options.files, common)
}

fn finish(options: &PlotOptions, chosen: &Chosen, inputs: &[PathBuf], common: &Common) -> Result<CommandEnd, Error> {
    let report = PlotReport {
        files: write(options, &chosen.figures, inputs)?,
        chosen,
        inputs: &options.files,
    };
    tell(common, &report)
}

enum StudyKind {
    Run,
    Sweep(Box<StudyFile>),
    WorkPrecision,
    Branches,
}

#[derive(Default, Serialize)]
struct Chosen {
    #[serde(skip)]
    figures: Vec<Figure>,
    not_drawn: Vec<NotDrawn>,
    /// Options for `stickslip run FILE --set ...` with which the run would have the missing figures.
    #[serde(skip_serializing_if = "Option::is_none")]
    sampling: Option<String>,
    #[serde(skip_serializing_if = "Vec::is_empty", serialize_with = "summaries")]
    distributions: Vec<(StudyColumn, Distribution)>,
}

fn summaries<S: Serializer>(all: &[(StudyColumn, Distribution)], serializer: S) -> Result<S::Ok, S::Error> {
    serializer.collect_seq(all.iter().map(DistributionSummary::new))
}

impl Chosen {
    fn of(figures: Vec<Figure>) -> Chosen {
        Chosen {
            figures,
            ..Chosen::default()
        }
    }
}

#[derive(Serialize)]
struct NotDrawn {
    figure: &'static str,
    why: String,
}

fn kind(path: &Path) -> Result<StudyKind, Error> {
    let kind = match StudyFile::open(path, schema::SWEEP_FORMAT) {
        Ok(file) => StudyKind::Sweep(Box::new(file)),
        Err(error) if matches!(error.reason, Reason::OnlyAShard | Reason::Uneven { .. }) => return Err(error.into()),
        Err(_) if StudyFile::is(path, schema::WORK_PRECISION_FORMAT) => StudyKind::WorkPrecision,
        Err(_) if Stored::is_one(path) => StudyKind::Branches,
        // The command that draws the file will report the error.
        Err(_) if ResultFile::open(path).is_err() => return Ok(StudyKind::Run),
        Err(_) => StudyKind::Run,
    };
    check_sound(path)?;
    Ok(kind)
}

fn choice(options: &PlotOptions) -> Result<Choice, Error> {
    let place = |text: &String| match text.split_once('=') {
        Some((name, value)) => Ok((name.trim().to_owned(), value.trim().to_owned())),
        None => Err(Error::input(format!(
            "--at {text}: expected AXIS=VALUE, such as torsion.damping=22"
        ))),
    };
    Ok(Choice {
        quantities: options.quantities.clone(),
        axes: <[String; 2]>::try_from(options.axes.clone()).ok(),
        at: options.at.iter().map(place).collect::<Result<_, _>>()?,
    })
}

fn of_sweep(file: &StudyFile, choice: &Choice, only: &[String]) -> Result<Chosen, Error> {
    let figures = named(studies::figures(file, choice)?, only, file.path())?;
    let mut chosen = Chosen::of(figures);
    chosen.distributions = studies::distributions(file, choice)?;
    Ok(chosen)
}

/// The figures of a continuation with the requested quantities or names, or the most important ones.
fn of_branches(path: &Path, runs: Option<&StudyFile>, quantities: &[String], only: &[String]) -> Result<Chosen, Error> {
    let mut file = Branches::read(path)?;
    if let Some(runs) = runs {
        file = file.with_runs(runs)?;
    }
    let figures = match (quantities, only) {
        ([], [_, ..]) => file.all()?,
        _ => file.figures(quantities)?,
    };
    Ok(Chosen::of(named(figures, only, path)?))
}

fn all_of_branches(path: &Path) -> Result<Chosen, Error> {
    Ok(Chosen::of(Branches::read(path)?.all()?))
}

fn named(mut figures: Vec<Figure>, only: &[String], path: &Path) -> Result<Vec<Figure>, Error> {
    if only.is_empty() {
        return Ok(figures);
    }
    let known: Vec<String> = figures.iter().map(|figure| figure.name.clone()).collect();
    figures.retain(|figure| only.iter().any(|name| is_named(figure, name)));
    match figures.is_empty() {
        true => Err(Error::of_file(
            path,
            format!("has no figure {}; there are {}", only.join(", "), known.join(", ")),
        )),
        false => Ok(figures),
    }
}

fn is_named(figure: &Figure, name: &str) -> bool {
    let (own, name) = (catalogue::hyphenated(&figure.name), catalogue::hyphenated(name));
    let of_kind = own.strip_prefix(&*name).is_some_and(|rest| rest.starts_with('-'));
    let mut entries = studies::ENTRIES.iter().chain(&branches::ENTRIES);
    let entry = entries.any(|entry| entry.name == name);
    let number = figure.paper_figure.map(|number| number.to_string());
    own == name || entry && of_kind || number.as_deref() == Some(&*name)
}

fn of_work_precision(path: &Path) -> Result<Chosen, Error> {
    Ok(Chosen::of(vec![accuracy::of_file(path)?]))
}

fn one_kind(runs: &[DrawnRun]) -> Result<(), Error> {
    let motion = |run: &DrawnRun| run.case.motion();
    let name = |run: &DrawnRun| match motion(run) {
        Motion::Rotation => "of a rotation",
        Motion::Translation => "of a translation",
    };
    let Some(first) = runs.first() else { return Ok(()) };
    match runs.iter().find(|run| motion(run) != motion(first)) {
        Some(other) => Err(Error::input(format!(
            "{} is {}, and {} is {}: they have no axes in common; draw each by itself",
            first.path().display(),
            name(first),
            other.path().display(),
            name(other)
        ))),
        None => Ok(()),
    }
}

const CAN_DRAW: &str = "plot draws the results of `stickslip run` and `certify`, sweeps (also merged ones), calibrations, \
                        work-precision studies and continuations";

/// The files of a continuation and a sweep, in any order, if there are these two.
fn branches_and_runs(files: &[PathBuf]) -> Result<Option<(&Path, Box<StudyFile>)>, Error> {
    let [one, other] = files else { return Ok(None) };
    if !Stored::is_one(one) && !Stored::is_one(other) {
        return Ok(None);
    }
    Ok(match (kind(one)?, kind(other)?) {
        (StudyKind::Branches, StudyKind::Sweep(runs)) => Some((one.as_path(), runs)),
        (StudyKind::Sweep(runs), StudyKind::Branches) => Some((other.as_path(), runs)),
        _ => None,
    })
}

/// The figures of a file with many runs; `None` for a file with a single run.
fn of_many_runs(options: &PlotOptions) -> Result<Option<Chosen>, Error> {
    let choice = choice(options)?;
    if let Some((branches, runs)) = branches_and_runs(&options.files)? {
        if choice.axes.is_some() || !choice.at.is_empty() || options.candidate.is_some() {
            return Err(Error::of_file(
                branches,
                "branches with the runs of a sweep; choose with --quantity or --only",
            ));
        }
        return Ok(Some(of_branches(
            branches,
            Some(&runs),
            &choice.quantities,
            &options.only,
        )?));
    }
    for path in &options.files {
        let kind = kind(path)?;
        if matches!(kind, StudyKind::Run) {
            continue;
        }
        let refused = |why: &str| Err(Error::of_file(path, why));
        if options.files.len() > 1 {
            return refused(
                "holds many runs, and is drawn by itself; give one file, or branches with a sweep over their parameter",
            );
        }
        if options.candidate.is_some() {
            return refused(
                "holds many runs, and --candidate is drawn with the result of one; name that, or leave it out",
            );
        }
        if !(options.channels.is_empty() && options.phase.is_empty()) || options.from.is_some() || options.to.is_some()
        {
            return refused(
                "holds the summaries of many runs and no channels; leave out --channel, --phase, --from and --to, or choose \
                 with --quantity, --axes and --at",
            );
        }
        return match &kind {
            StudyKind::Sweep(file) => Ok(Some(of_sweep(file, &choice, &options.only)?)),
            StudyKind::Branches if choice.axes.is_some() || !choice.at.is_empty() => refused(
                "branches, whose points lie on curves over one parameter; leave out --axes and --at, and choose with --quantity",
            ),
            StudyKind::Branches => Ok(Some(of_branches(path, None, &choice.quantities, &options.only)?)),
            _ if !choice.is_empty() => refused(
                "a work-precision study, of which one figure is drawn; leave out --quantity, \
                                                --axes and --at",
            ),
            _ => Ok(Some(of_work_precision(path)?)),
        };
    }
    if choice.is_empty() {
        return Ok(None);
    }
    let file = options
        .files
        .first()
        .map(|path| format!("{}: ", path.display()))
        .unwrap_or_default();
    Err(Error::input(format!(
        "{file}--quantity, --axes and --at are for the file of a sweep or continuation; of a run draw a channel with --channel NAME"
    )))
}

fn beside(options: &PlotOptions, candidate: &Path, common: &Common) -> Result<CommandEnd, Error> {
    let [file] = &options.files[..] else {
        return Err(Error::input(format!(
            "--candidate is drawn with one result, and {} files are given; name one, or leave out --candidate to draw \
             them over each other",
            options.files.len()
        )));
    };
    if options.channels.is_empty() && (options.from.is_some() || options.to.is_some()) {
        return Err(Error::input(
            "--from and --to are for named channels; name what to draw with the candidate by --channel NAME",
        ));
    }
    let run = DrawnRun::open(file)?;
    let reference = open_reference(file)?;
    let mapping = MappingOptions {
        map: options.map.as_deref(),
        columns: &options.columns,
        // No figure shows a cause.
        quick: true,
        ..MappingOptions::default()
    };
    let mapping = mapping.of(&reference)?;
    let beside = DrawnCandidate {
        reference: &reference,
        run: &run,
        path: candidate,
        mapping: &mapping,
    };
    let figures = if options.channels.is_empty() {
        let comparison = reference.compare(candidate, &mapping)?;
        beside.figures(&comparison)?
    } else {
        let window = own::window(std::slice::from_ref(&run), options.from, options.to)?;
        beside.channels_over_time(&options.channels, window)?
    };
    let mut inputs = options.files.clone();
    inputs.push(candidate.to_owned());
    inputs.extend(options.map.clone());
    finish(options, &Chosen::of(figures), &inputs, common)
}

/// Adds the list of files that can be drawn to the error of another kind of file or a newer version.
fn no_run(mut error: Error) -> Error {
    if error.kind == ErrorKind::AnotherKind {
        error.text += &format!(". {CAN_DRAW}");
    }
    error
}

fn html(options: &PlotOptions, path: &Path, common: &Common) -> Result<CommandEnd, Error> {
    for file in &options.files {
        let why = match kind(file)? {
            StudyKind::Run if options.quantities.is_empty() => continue,
            StudyKind::Run => {
                "--quantity is for the page of a sweep or continuation; leave it out, the page of a run has all channels"
            }
            StudyKind::WorkPrecision => "a work-precision study has no page; leave out --html to draw its figure",
            StudyKind::Sweep(_) | StudyKind::Branches if options.files.len() > 1 => {
                "a sweep or a continuation has a page of its own; give one file"
            }
            StudyKind::Branches => {
                let branches = Branches::read(file)?;
                let page = branches::page::write(&branches, &options.quantities, path, options.force)?;
                return finish_page((path, options.open), &page, common);
            }
            StudyKind::Sweep(sweep) => {
                let page = studies::page::write(&sweep, &options.quantities, path, options.force)?;
                return finish_page((path, options.open), &page, common);
            }
        };
        return Err(Error::of_file(file, why));
    }
    let page = match &options.files[..] {
        [file] => {
            let file = ResultFile::open(file).map_err(|error| no_run(error.into()))?;
            page::write(&file, None, path, options.force)
        }
        [first, second] => {
            one_kind(&[DrawnRun::open(first)?, DrawnRun::open(second)?])?;
            page::write(
                &ResultFile::open(first)?,
                Some(&ResultFile::open(second)?),
                path,
                options.force,
            )
        }
        files => {
            return Err(Error::input(format!(
                "--html shows one run on a page, or two, and {} files are given; make a page of each or of two at a time, or leave \
                 out --html to draw them over each other",
                files.len()
            )));
        }
    };
    finish_page((path, options.open), &page?, common)
}

/// Tells about a page, and opens it in the browser if `open`.
fn finish_page((path, open): (&Path, bool), page: &impl Serialize, common: &Common) -> Result<CommandEnd, Error> {
    let file = path.display().to_string();
    tell(common, &WrittenPage { file, page })?;
    if open {
        open::that_detached(path).map_err(|error| {
            let file = path.display();
            Error::computation(format!(
                "{file}: written, but no browser could be started: {error}; open the file in one yourself"
            ))
        })?;
    }
    Ok(CommandEnd::Done)
}

#[derive(Serialize)]
struct WrittenPage<'a, P> {
    file: String,
    page: &'a P,
}

impl<P: Serialize> Report for WrittenPage<'_, P> {
    fn page(&self) -> Page {
        Page::new(&*self.file, "")
    }
}

fn list(options: &PlotOptions, common: &Common) -> Result<CommandEnd, Error> {
    let listed = match options.files.first() {
        Some(path) => listed_of(path, options)?,
        None => all_listed(),
    };
    show(common, &listed)
}

/// Figures of a file, or of any file.
impl Report for Vec<ListedFigure> {
    fn page(&self) -> Page {
        Page::default().with(
            PageTable::of(self)
                .text("figure", |entry| entry.figure.clone())
                .count("paper", |entry| {
                    entry.paper_figure.map(|n| n.to_string()).unwrap_or_default()
                })
                .text("of", |entry| entry.of)
                .text("shows", |entry| entry.title.clone())
                .done(),
        )
    }
}

fn listed(name: &str, title: &str, paper_figure: Option<u32>, of: &'static str) -> ListedFigure {
    ListedFigure {
        figure: name.to_owned(),
        title: title.to_owned(),
        paper_figure,
        of,
    }
}

fn all_listed() -> Vec<ListedFigure> {
    let of_runs = [
        (ENTRIES, "run"),
        (portraits::ENTRIES, "run of trains"),
        (certified::ENTRIES, "certified run"),
    ];
    let of_runs = of_runs
        .into_iter()
        .flat_map(|(entries, of)| entries.iter().map(move |e| (e, of)));
    let of_runs = of_runs.map(|(e, of)| listed(e.name, e.title, e.paper_figure, of));
    let of_studies = studies::ENTRIES
        .iter()
        .chain(&branches::ENTRIES)
        .map(|e| listed(e.name, e.title, e.paper_figure, e.of));
    let title = "Error against work, by method";
    let last = listed(accuracy::WORK_PRECISION, title, None, "work-precision study");
    of_runs.chain(of_studies).chain([last]).collect()
}

fn listed_of(path: &Path, options: &PlotOptions) -> Result<Vec<ListedFigure>, Error> {
    let choice = choice(options)?;
    let (drawn, of) = match kind(path)? {
        StudyKind::Run => {
            let run = DrawnRun::open(path).map_err(no_run)?;
            let of = if run.stops() { "run" } else { "run of trains" };
            let entries = catalogue::of_run(&run).into_iter();
            let entries = entries.map(|e| listed(e.name, &in_words_of(&run, e.title), e.paper_figure, of));
            return Ok(entries.collect());
        }
        StudyKind::Sweep(file) => (of_sweep(&file, &choice, &[])?, "sweep"),
        StudyKind::WorkPrecision => (of_work_precision(path)?, "work-precision study"),
        StudyKind::Branches => (all_of_branches(path)?, "continuation"),
    };
    let figures = drawn.figures.iter();
    Ok(figures.map(|f| listed(&f.name, &f.title, f.paper_figure, of)).collect())
}

fn tell_status(run: &DrawnRun) {
    let how = match run.status() {
        Status::Complete => return,
        Status::Interrupted => "was interrupted (or still runs)",
        Status::Failed(_) => "failed",
    };
    complain(&format!(
        "warning: {}: this run {how}; drawn is what is there, up to t = {:.6} s",
        run.path().display(),
        run.times.1
    ));
}

fn figures(options: &PlotOptions, runs: &[DrawnRun], only: &[&CatalogueEntry]) -> Result<Chosen, Error> {
    if !options.channels.is_empty() || !options.phase.is_empty() {
        if let (Some(from), Some(to)) = (options.from, options.to)
            && from > to
        {
            return Err(Error::input(format!(
                "--from {from} is after --to {to}; a figure goes from an earlier to a later time"
            )));
        }
        return Ok(Chosen::of(own_figures(options, runs)?));
    }
    if options.from.is_some() || options.to.is_some() {
        return Err(Error::input(
            "--from and --to are for --channel and --phase; the figures of the paper find their windows by the events. \
             Name what to draw with --channel NAME or --phase A B",
        ));
    }
    let Some(subject) = Subject::new(runs) else {
        return Ok(Chosen::default());
    };
    let all = catalogue::of_run(subject.run);
    let (mut chosen, mut absent) = (Chosen::default(), Vec::new());
    for entry in if only.is_empty() { &all[..] } else { only } {
        match entry.build(&subject)? {
            Ok(figure) => chosen.figures.push(figure),
            Err(missing) => absent.push((entry, missing)),
        }
    }
    let missing: Vec<_> = absent.iter().map(|(_, missing)| missing).collect();
    chosen.sampling = catalogue::sampling(subject.run, &missing);
    // A figure that was requested by name must exist.
    if let (Some((entry, missing)), false) = (absent.first(), only.is_empty()) {
        let path = subject.run.path().display();
        let remedy = chosen.sampling.as_deref().map(|text| remedy(text, subject.run.path()));
        return Err(Error::input(format!(
            "{path}: {} cannot be drawn: {}{}",
            entry.name,
            missing.why,
            remedy.map(|text| format!("; {text}")).unwrap_or_default()
        )));
    }
    let not_drawn = absent.into_iter().map(|(entry, missing)| NotDrawn {
        figure: entry.name,
        why: missing.why,
    });
    chosen.not_drawn = not_drawn.collect();
    Ok(chosen)
}

fn remedy(sampling: &str, path: &Path) -> String {
    format!(
        "repeat the run with closer samples: stickslip run {} --set '{sampling}'",
        path.display()
    )
}

const FEW: usize = 3;

fn own_figures(options: &PlotOptions, runs: &[DrawnRun]) -> Result<Vec<Figure>, Error> {
    let window = own::window(runs, options.from, options.to)?;
    let mut figures = Vec::new();
    let title = |what: &str| match runs {
        [run] => format!("{}: {what}", run.label()),
        _ => capitalised(what),
    };
    let against = |x: &str, y: &str| -> Result<Figure, Error> {
        let Some(run) = runs.first() else {
            return Err(Error::drawing("no run"));
        };
        let what = format!("{} against {}", run.axis(y)?.name, run.axis(x)?.name);
        own::phase(runs, &format!("{y}-against-{x}"), &title(&what), (x, y), window)
    };
    match &options.x {
        Some(x) => {
            for y in &options.channels {
                figures.push(against(x, y)?);
            }
        }
        None if !options.channels.is_empty() => {
            let channels: Vec<&str> = options.channels.iter().map(String::as_str).collect();
            let axes = runs.iter().take(1).flat_map(|run| channels.iter().map(|c| run.axis(c)));
            let names = axes.map(|axis| Ok(axis?.name)).collect::<Result<Vec<_>, Error>>()?;
            let what = match names.len() {
                ..=FEW => names.join(", "),
                many => format!("{many} channels"),
            };
            figures.push(own::channels(runs, &title(&what), &channels, window)?);
        }
        None => {}
    }
    for pair in options.phase.chunks_exact(2) {
        figures.push(against(&pair[0], &pair[1])?);
    }
    Ok(figures)
}

/// Extensions that certainly belong to no folder.
const OTHER_FORMATS: [&str; 14] = [
    "eps", "ps", "jpg", "jpeg", "tif", "tiff", "gif", "webp", "html", "h5", "csv", "npz", "mat", "json",
];

fn targets(options: &PlotOptions, figures: &[Figure]) -> Result<Vec<(usize, PathBuf, FigureFormat)>, Error> {
    let path = options.output.clone();
    let no_folder = || {
        let why = "several figures want a folder; one alone (--only, --channel, --phase) may have a file, whose name ends in .svg, \
                   .png or .pdf";
        Err(Error::of_file(&options.output, why))
    };
    let extension = path.extension().unwrap_or_default().to_ascii_lowercase();
    match FigureFormat::of_path(&path) {
        Some(format) if figures.len() == 1 => return Ok(vec![(0, path, format)]),
        Some(_) => return no_folder(),
        None if path.is_file() => return no_folder(),
        None if OTHER_FORMATS.iter().any(|other| extension == *other) => return Err(no_format(&path)),
        None => {}
    }
    let formats: &[FigureFormat] = match &options.format {
        Some(format) => std::slice::from_ref(format),
        None => &[FigureFormat::Svg, FigureFormat::Png],
    };
    let files: Vec<&PathBuf> = options.files.iter().chain(&options.candidate).collect();
    let file = |name: &str, format: &FigureFormat| {
        let name = file_name_of(&files, name);
        options.output.join(format!("{name}.{}", format.extension()))
    };
    let of_figure = |(k, figure): (usize, &Figure)| -> Vec<(usize, PathBuf, FigureFormat)> {
        formats.iter().map(|f| (k, file(&figure.name, f), *f)).collect()
    };
    Ok(figures.iter().enumerate().flat_map(of_figure).collect())
}

/// Longest part of a figure's name that its files' names make up, bytes.
const LONGEST_STEM: usize = 80;

/// The file name of a figure, without extension: the names of its files, then its own, with hyphens. A figure whose
/// name begins with that of its file has no second one.
pub(super) fn file_name_of(files: &[&PathBuf], figure: &str) -> String {
    let stems = files
        .iter()
        .map(|file| file.file_stem().unwrap_or_default().to_string_lossy());
    let stems: Vec<_> = stems.collect();
    let mut stem = stems.join("-and-");
    if stem.len() > LONGEST_STEM && stems.len() > 1 {
        stem = format!("{}-and-{}-more", stems[0], stems.len() - 1);
    }
    let figure = figure.replace('_', "-");
    match figure.strip_prefix(&*stem) {
        Some(rest) if rest.is_empty() || rest.starts_with('-') => figure,
        _ => format!("{stem}-{figure}"),
    }
}

fn write(options: &PlotOptions, figures: &[Figure], inputs: &[PathBuf]) -> Result<Vec<WrittenFigure>, Error> {
    let targets = targets(options, figures)?;
    let layout = layout(options)?;
    if FigureFormat::of_path(&options.output).is_none() && !targets.is_empty() {
        std::fs::create_dir_all(&options.output)
            .map_err(|error| FIGURE.failed(&options.output, "creating the folder", error))?;
    }
    let source = signature::source(inputs);
    let reserve = |(number, path, format): (usize, PathBuf, FigureFormat)| {
        Ok((number, Output::new(&path, FIGURE, inputs, options.force)?, format))
    };
    let targets = targets.into_iter().map(reserve).collect::<Result<Vec<_>, Error>>()?;
    let mut written = Vec::with_capacity(targets.len());
    let mut drawn: Option<(usize, Drawing)> = None;
    for (number, output, format) in targets {
        let figure = &figures[number];
        let drawing = match drawn.take().filter(|(of, _)| *of == number) {
            Some((_, drawing)) => drawing,
            None => Drawing {
                source: source.clone(),
                ..plot::draw(figure, layout)
            },
        };
        save(&output, &drawing, format, options.dpi)?;
        written.push(WrittenFigure {
            file: output.path().display().to_string(),
            figure: figure.name.clone(),
            title: figure.full_title(),
            paper_figure: figure.paper_figure,
        });
        drawn = Some((number, drawing));
    }
    Ok(written)
}

fn no_format(path: &Path) -> Error {
    let eps = match path.extension().is_some_and(|extension| extension == "eps") {
        true => " (`pdftops -eps figure.pdf` makes EPS)",
        false => "",
    };
    let why = format!("figures are SVG, PNG or PDF; give a name that ends in .svg, .png or .pdf{eps}");
    Error::of_file(path, why)
}

fn layout(options: &PlotOptions) -> Result<Layout, Error> {
    let layout = Layout {
        width: options.width,
        font_size: options.font_size,
        title: !options.no_title,
    };
    if layout.width < layout.least_width() {
        return Err(Error::input(format!(
            "--width {:.1}mm has no room for axes with letters of {} points; give at least {:.1}mm, or a smaller --font-size",
            layout.width,
            layout.font_size,
            layout.least_width()
        )));
    }
    Ok(layout)
}

pub(super) const OF_COMMAND: Product = Product::Figure("--figure");

/// A figure of another command, whose place is checked before anything is computed.
pub(super) type FigureOutput = (Output, FigureFormat);

/// The place of the figure of a case, with its changes in words.
pub(super) fn figure_output(
    path: Option<&Path>,
    force: bool,
    given: &GivenCase,
    changed: &[String],
) -> Result<Option<FigureOutput>, Error> {
    let Some(path) = path else { return Ok(None) };
    let format = FigureFormat::of_path(path).ok_or_else(|| no_format(path))?;
    let source: Vec<PathBuf> = [given.source.label()]
        .iter()
        .chain(changed)
        .map(PathBuf::from)
        .collect();
    let source = (&given.files[..], signature::source(&source));
    Ok(Some((Output::made_from(path, OF_COMMAND, source, force)?, format)))
}

pub(super) fn draw(figure: &Figure, (output, format): &FigureOutput) -> Result<(), Error> {
    let drawing = Drawing {
        source: output.source().to_owned(),
        ..plot::draw(figure, style::COLUMN_WIDTH)
    };
    save(output, &drawing, *format, DPI)
}

fn save(output: &Output, drawing: &Drawing, format: FigureFormat, dpi: f64) -> Result<(), Error> {
    match format {
        FigureFormat::Svg => output.write(&[drawing.svg().as_bytes()]),
        FigureFormat::Png => output.write(&[&drawing.png(dpi)?]),
        FigureFormat::Pdf => output.write(&[&drawing.pdf()?]),
    }
}

/// Most files that a terminal lists without `-v`.
const FEW_FILES: usize = 8;

/// Longest list of names on a terminal, characters: about four lines.
const LONGEST_LIST: usize = 380;

/// Longest line of the list, characters.
const WIDTH_OF_LIST: usize = 100;

/// Number, folder, formats and the first names of figures.
fn in_short(files: &[WrittenFigure]) -> String {
    let paths = || files.iter().map(|written| Path::new(&written.file));
    let once = |texts: Vec<String>| {
        let mut seen = std::collections::HashSet::new();
        let new = texts.into_iter().filter(|text| seen.insert(text.clone()));
        new.collect::<Vec<_>>()
    };
    let part = |text: Option<&std::ffi::OsStr>| text.unwrap_or_default().to_string_lossy().into_owned();
    let names = once(paths().map(|path| part(path.file_stem())).collect());
    let formats = once(paths().map(|path| part(path.extension()).to_uppercase()).collect());
    let folder = paths().next().and_then(Path::parent).unwrap_or(Path::new(""));
    let folder = folder.join("").display().to_string();
    let mut text = format!("{} figures in {folder}, as {}:", names.len(), formats.join(" and "));
    let mut width = text.chars().count();
    for (number, name) in names.iter().enumerate() {
        if text.len() + name.len() > LONGEST_LIST {
            text += &format!(" and {} more (-v lists all)", names.len() - number);
            break;
        }
        let comma = if number + 1 < names.len() { "," } else { "" };
        let one_more = 1 + name.chars().count() + comma.len();
        if width + one_more > WIDTH_OF_LIST {
            text += "\n ";
            width = 1;
        }
        text += &format!(" {name}{comma}");
        width += one_more;
    }
    text
}

impl Report for PlotReport<'_> {
    fn page(&self) -> Page {
        let (chosen, inputs) = (self.chosen, self.inputs);
        let files = self.files.iter().map(|written| written.file.clone());
        let (files, page) = match self.files.len() {
            ..=FEW_FILES => (files.collect(), Page::default()),
            _ => {
                let names = files.collect::<Vec<_>>().join("\n");
                (Vec::new(), Page::default().with(in_short(&self.files)).details([names]))
            }
        };
        let missing = chosen
            .not_drawn
            .iter()
            .map(|missing| format!("{}: {}", missing.figure, missing.why));
        let not_drawn = (!chosen.not_drawn.is_empty()).then_some("not drawn:");
        let remedy = chosen
            .sampling
            .iter()
            .zip(inputs)
            .map(|(sampling, path)| remedy(sampling, path));
        let page = page.below(files).with_all(not_drawn).below(missing).with_all(remedy);
        chosen.distributions.iter().fold(page, distribution)
    }
}
