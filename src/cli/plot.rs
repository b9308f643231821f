//! `stickslip plot`: draws figures and pages of files.

use super::arguments::{Common, DPI, FigureFormat, PlotOptions};
use super::input::columns;
use super::plot_studies::{self, Chosen, NotDrawn, StudyKind};
use super::reference::open_reference;
use super::{CommandEnd, CommandError, complain, show, tell};
use crate::plot::branches::{self, Branches};
use crate::plot::catalogue::{self, ENTRIES, in_words_of};
use crate::plot::comparison::DrawnCandidate;
use crate::plot::entry::{CatalogueEntry, Subject};
use crate::plot::target::{self, Product, TargetError};
use crate::plot::{
    self, Drawing, DrawnRun, Figure, Layout, PlotError, accuracy, certified, own, page, portraits, signature, studies,
    style,
};
use crate::report::{DistributionSummary, Page, PageTable, Report, distribution};
use serde::Serialize;
use std::path::{Path, PathBuf};
use stickslip_analysis::analysis::advice::capitalised;
use stickslip_case::Motion;
use stickslip_compare::Mapping;
use stickslip_files::{Reason, ResultFile, Status};

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
    not_drawn: &'a [NotDrawn],
    /// Options for `stickslip run FILE --set ...` with which the run would have the missing figures.
    #[serde(skip_serializing_if = "Option::is_none")]
    sampling: Option<&'a str>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    distributions: Vec<DistributionSummary<'a>>,
    #[serde(skip)]
    of: (&'a Chosen, &'a [PathBuf]),
}

#[derive(Serialize)]
struct ListedFigure {
    figure: String,
    title: String,
    paper_figure: Option<u32>,
    of: &'static str,
}

pub(super) fn plot(options: &PlotOptions, common: &Common) -> Result<CommandEnd, CommandError> {
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

fn finish(
    options: &PlotOptions,
    chosen: &Chosen,
    inputs: &[PathBuf],
    common: &Common,
) -> Result<CommandEnd, CommandError> {
    let report = PlotReport {
        files: write(options, &chosen.figures, inputs)?,
        not_drawn: &chosen.not_drawn,
        sampling: chosen.sampling.as_deref(),
        distributions: chosen.distributions.iter().map(DistributionSummary::new).collect(),
        of: (chosen, &options.files),
    };
    tell(common, &report)?;
    Ok(CommandEnd::Done)
}

fn one_kind(runs: &[DrawnRun]) -> Result<(), CommandError> {
    let motion = |run: &DrawnRun| run.case.motion();
    let name = |run: &DrawnRun| match motion(run) {
        Motion::Rotation => "of a rotation",
        Motion::Translation => "of a translation",
    };
    let Some(first) = runs.first() else { return Ok(()) };
    match runs.iter().find(|run| motion(run) != motion(first)) {
        Some(other) => Err(CommandError::input(format!(
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

fn refusal(path: &Path, why: &str) -> CommandError {
    CommandError::input(format!("{}: {why}", path.display()))
}

/// The figures of a file with many runs; `None` for a file with a single run.
fn of_many_runs(options: &PlotOptions) -> Result<Option<Chosen>, CommandError> {
    let choice = plot_studies::choice(options).map_err(CommandError::input)?;
    for path in &options.files {
        let kind = plot_studies::kind(path)?;
        if matches!(kind, StudyKind::Run) {
            continue;
        }
        let refused = |why: &str| Err(refusal(path, why));
        if options.files.len() > 1 {
            return refused("holds many runs, and is drawn by itself; give one file");
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
            StudyKind::Sweep(file) => Ok(Some(plot_studies::of_sweep(file, &choice, &options.only)?)),
            StudyKind::Branches if choice.axes.is_some() || !choice.at.is_empty() => refused(
                "branches, whose points lie on curves over one parameter; leave out --axes and --at, and choose with --quantity",
            ),
            StudyKind::Branches => Ok(Some(plot_studies::of_branches(
                path,
                &choice.quantities,
                &options.only,
            )?)),
            _ if !choice.is_empty() => refused(
                "a work-precision study, of which one figure is drawn; leave out --quantity, \
                                                --axes and --at",
            ),
            _ => Ok(Some(plot_studies::of_work_precision(path)?)),
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
    Err(CommandError::input(format!(
        "{file}--quantity, --axes and --at are for the file of a sweep or continuation; of a run draw a channel with --channel NAME"
    )))
}

fn beside(options: &PlotOptions, candidate: &Path, common: &Common) -> Result<CommandEnd, CommandError> {
    let [file] = &options.files[..] else {
        return Err(CommandError::input(format!(
            "--candidate is drawn with one result, and {} files are given; name one, or leave out --candidate to draw \
             them over each other",
            options.files.len()
        )));
    };
    if options.channels.is_empty() && (options.from.is_some() || options.to.is_some()) {
        return Err(CommandError::input(
            "--from and --to are for named channels; name what to draw with the candidate by --channel NAME",
        ));
    }
    let run = DrawnRun::open(file)?;
    let reference = open_reference(file)?;
    let mapping = Mapping {
        // No figure shows a cause.
        quick: true,
        ..columns(&reference, options.map.as_deref(), &options.columns)?
    };
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
fn no_run(error: PlotError) -> CommandError {
    let known = matches!(&error, PlotError::Result(error) if matches!(
        error.reason,
        Reason::NotAResult(_) | Reason::Newer { .. } | Reason::AnotherKind(_)
    ));
    let mut error = CommandError::from(error);
    if known {
        error.text += &format!(". {CAN_DRAW}");
    }
    error
}

fn html(options: &PlotOptions, path: &Path, common: &Common) -> Result<CommandEnd, CommandError> {
    for file in &options.files {
        let why = match plot_studies::kind(file)? {
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
                return finish_page(path, &page, common);
            }
            StudyKind::Sweep(sweep) => {
                let page = studies::page::write(&sweep, &options.quantities, path, options.force)?;
                return finish_page(path, &page, common);
            }
        };
        return Err(refusal(file, why));
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
            return Err(CommandError::input(format!(
                "--html shows one run on a page, or two, and {} files are given; make a page of each or of two at a time, or leave \
                 out --html to draw them over each other",
                files.len()
            )));
        }
    };
    finish_page(path, &page?, common)
}

fn finish_page(path: &Path, page: &impl Serialize, common: &Common) -> Result<CommandEnd, CommandError> {
    let file = path.display().to_string();
    tell(common, &WrittenPage { file, page })?;
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

fn list(options: &PlotOptions, common: &Common) -> Result<CommandEnd, CommandError> {
    let listed = match options.files.first() {
        Some(path) => listed_of(path, options)?,
        None => all_listed(),
    };
    show(common, &listed)?;
    Ok(CommandEnd::Done)
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

fn listed_of(path: &Path, options: &PlotOptions) -> Result<Vec<ListedFigure>, CommandError> {
    let choice = plot_studies::choice(options).map_err(CommandError::input)?;
    let (drawn, of) = match plot_studies::kind(path)? {
        StudyKind::Run => {
            let run = DrawnRun::open(path).map_err(no_run)?;
            let of = if run.stops() { "run" } else { "run of trains" };
            let entries = catalogue::of_run(&run).into_iter();
            let entries = entries.map(|e| listed(e.name, &in_words_of(&run, e.title), e.paper_figure, of));
            return Ok(entries.collect());
        }
        StudyKind::Sweep(file) => (plot_studies::of_sweep(&file, &choice, &[])?, "sweep"),
        StudyKind::WorkPrecision => (plot_studies::of_work_precision(path)?, "work-precision study"),
        StudyKind::Branches => (plot_studies::all_of_branches(path)?, "continuation"),
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

fn figures(options: &PlotOptions, runs: &[DrawnRun], only: &[&CatalogueEntry]) -> Result<Chosen, CommandError> {
    if !options.channels.is_empty() || !options.phase.is_empty() {
        if let (Some(from), Some(to)) = (options.from, options.to)
            && from > to
        {
            return Err(CommandError::input(format!(
                "--from {from} is after --to {to}; a figure goes from an earlier to a later time"
            )));
        }
        return Ok(Chosen::of(own_figures(options, runs)?));
    }
    if options.from.is_some() || options.to.is_some() {
        return Err(CommandError::input(
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
        return Err(CommandError::input(format!(
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

fn own_figures(options: &PlotOptions, runs: &[DrawnRun]) -> Result<Vec<Figure>, PlotError> {
    let window = own::window(runs, options.from, options.to)?;
    let mut figures = Vec::new();
    let title = |what: &str| match runs {
        [run] => format!("{}: {what}", run.label()),
        _ => capitalised(what),
    };
    let against = |x: &str, y: &str| -> Result<Figure, PlotError> {
        let Some(run) = runs.first() else {
            return Err(PlotError::Drawing("no run".to_owned()));
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
            let names = axes.map(|axis| Ok(axis?.name)).collect::<Result<Vec<_>, PlotError>>()?;
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

fn targets(options: &PlotOptions, figures: &[Figure]) -> Result<Vec<(usize, PathBuf, FigureFormat)>, PlotError> {
    let path = options.output.clone();
    let extension = path.extension().unwrap_or_default().to_ascii_lowercase();
    match FigureFormat::of_path(&path) {
        Some(format) if figures.len() == 1 => return Ok(vec![(0, path, format)]),
        Some(_) => return Err(PlotError::NoFolder { path }),
        None if path.is_file() => return Err(PlotError::NoFolder { path }),
        None if OTHER_FORMATS.iter().any(|other| extension == *other) => return Err(PlotError::Format { path }),
        None => {}
    }
    let formats: &[FigureFormat] = match &options.format {
        Some(format) => std::slice::from_ref(format),
        None => &[FigureFormat::Svg, FigureFormat::Png],
    };
    let file = |name: &str, format: &FigureFormat| options.output.join(format!("{name}.{}", format.extension()));
    let of_figure = |(k, figure): (usize, &Figure)| -> Vec<(usize, PathBuf, FigureFormat)> {
        formats.iter().map(|f| (k, file(&figure.name, f), *f)).collect()
    };
    Ok(figures.iter().enumerate().flat_map(of_figure).collect())
}

fn write(options: &PlotOptions, figures: &[Figure], inputs: &[PathBuf]) -> Result<Vec<WrittenFigure>, CommandError> {
    let targets = targets(options, figures)?;
    let layout = layout(options)?;
    if FigureFormat::of_path(&options.output).is_none() && !targets.is_empty() {
        std::fs::create_dir_all(&options.output)
            .map_err(|error| TargetError::failed(&options.output, FIGURE, "creating the folder", error))?;
    }
    let source = signature::source(inputs);
    let named = FigureFormat::of_path(&options.output).is_some();
    for (_, path, _) in &targets {
        target::check(path, FIGURE, inputs, options.force)?;
        if !named && !options.force {
            spare(path, &source, FIGURE)?;
        }
    }
    let mut written = Vec::with_capacity(targets.len());
    let mut drawn: Option<(usize, Drawing)> = None;
    for (number, path, format) in targets {
        let figure = &figures[number];
        let drawing = match drawn.take().filter(|(of, _)| *of == number) {
            Some((_, drawing)) => drawing,
            None => Drawing {
                source: source.clone(),
                ..plot::draw(figure, layout)?
            },
        };
        save(&path, FIGURE, &drawing, format, options.dpi)?;
        written.push(WrittenFigure {
            file: path.display().to_string(),
            figure: figure.name.clone(),
            title: figure.full_title(),
            paper_figure: figure.paper_figure,
        });
        drawn = Some((number, drawing));
    }
    Ok(written)
}

/// Refuses to replace a figure of other files than `source`, if this program chose the name of the new figure.
pub(super) fn spare(path: &Path, source: &str, product: Product) -> Result<(), PlotError> {
    let here = signature::names_in(source).unwrap_or_default();
    match target::drawn_from(path) {
        Some(there) if there != here => Err(PlotError::OfAnotherFile {
            path: path.to_owned(),
            there,
            here: here.to_owned(),
            option: product.option(),
        }),
        _ => Ok(()),
    }
}

fn layout(options: &PlotOptions) -> Result<Layout, CommandError> {
    let layout = Layout {
        width: options.width,
        font_size: options.font_size,
        title: !options.no_title,
    };
    if layout.width < layout.least_width() {
        return Err(CommandError::input(format!(
            "--width {:.1}mm has no room for axes with letters of {} points; give at least {:.1}mm, or a smaller --font-size",
            layout.width,
            layout.font_size,
            layout.least_width()
        )));
    }
    Ok(layout)
}

pub(super) const OF_COMMAND: Product = Product::Figure("--figure");

/// The target of a figure from another command, checked before anything is computed.
pub(super) fn figure_target<'a>(
    path: Option<&'a Path>,
    force: bool,
    inputs: &[PathBuf],
) -> Result<Option<(&'a Path, FigureFormat)>, CommandError> {
    let Some(path) = path else { return Ok(None) };
    let format = FigureFormat::of_path(path).ok_or_else(|| PlotError::Format { path: path.to_owned() })?;
    target::check(path, OF_COMMAND, inputs, force)?;
    Ok(Some((path, format)))
}

pub(super) fn draw(figure: &Figure, (path, format): (&Path, FigureFormat), source: String) -> Result<(), PlotError> {
    let drawing = Drawing {
        source,
        ..plot::draw(figure, style::COLUMN_WIDTH)?
    };
    save(path, OF_COMMAND, &drawing, format, DPI)
}

fn save(path: &Path, figure: Product, drawing: &Drawing, format: FigureFormat, dpi: f64) -> Result<(), PlotError> {
    match format {
        FigureFormat::Svg => target::write(path, figure, &[drawing.svg().as_bytes()])?,
        FigureFormat::Png => target::write(path, figure, &[&drawing.png(dpi)?])?,
        FigureFormat::Pdf => target::write(path, figure, &[&drawing.pdf()?])?,
    }
    Ok(())
}

impl Report for PlotReport<'_> {
    fn page(&self) -> Page {
        let (chosen, inputs) = self.of;
        let files = self.files.iter().map(|written| written.file.clone());
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
        let page = Page::default()
            .below(files)
            .with_all(not_drawn)
            .below(missing)
            .with_all(remedy);
        chosen.distributions.iter().fold(page, distribution)
    }
}
