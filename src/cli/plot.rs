//! `stickslip plot`.

use super::arguments::{Common, Format, PlotOptions};
use super::{CommandError, End, complain, print, print_json, terminal};
use crate::plot::catalogue::{self, ENTRIES, Entry, Story};
use crate::plot::{Figure, PlotError, Run, own, raster, svg, target};
use crate::results::Status;
use serde::Serialize;
use std::path::{Path, PathBuf};

/// The JSON document of a plot.
#[derive(Serialize)]
struct PlotDocument {
    files: Vec<Written>,
    not_drawn: Vec<NotDrawn>,
}

#[derive(Serialize)]
struct Written {
    file: String,
    figure: String,
    title: String,
    /// Number in the paper, where it is known.
    paper_figure: Option<u32>,
}

#[derive(Serialize)]
struct NotDrawn {
    figure: &'static str,
    why: String,
}

#[derive(Serialize)]
struct Listed {
    figure: &'static str,
    title: &'static str,
    paper_figure: Option<u32>,
}

/// Draws figures of one run, or of several over each other.
pub(super) fn plot(options: &PlotOptions, common: &Common) -> Result<End, CommandError> {
    if options.list {
        return list(common);
    }
    let chosen = options.only.iter().map(|name| catalogue::find(name));
    let chosen: Vec<&Entry> = chosen.collect::<Result<_, _>>().map_err(bad)?;
    let runs = options.files.iter().map(|path| Run::open(path));
    let runs: Vec<Run> = runs.collect::<Result<_, _>>().map_err(bad)?;
    for run in runs.iter().filter(|_| !common.quiet) {
        tell_status(run);
    }
    let (figures, not_drawn) = figures(options, &runs, &chosen)?;
    let written = write(options, &figures)?;
    if common.json {
        print_json(&PlotDocument {
            files: written,
            not_drawn,
        })?;
    } else if !common.quiet {
        print(&report(&written, &not_drawn))?;
    }
    Ok(End::Done)
}

/// The exit status that an error deserves.
pub(super) fn bad(error: PlotError) -> CommandError {
    match error {
        PlotError::Drawing(_) | PlotError::Io { .. } => CommandError::Computation(error.to_string()),
        _ => CommandError::Input(error.to_string()),
    }
}

fn list(common: &Common) -> Result<End, CommandError> {
    if common.json {
        let listed: Vec<Listed> = ENTRIES
            .iter()
            .map(|e| Listed {
                figure: e.name,
                title: e.title,
                paper_figure: e.paper_figure,
            })
            .collect();
        print_json(&listed)?;
        return Ok(End::Done);
    }
    let mut table = terminal::table(&["figure", "paper", "shows"]);
    for e in ENTRIES {
        let number = e.paper_figure.map(|n| n.to_string()).unwrap_or_default();
        table.add_row([e.name, &number, e.title]);
    }
    terminal::align_right(&mut table, [1]);
    print(&terminal::show(&table))?;
    Ok(End::Done)
}

/// Says of a run that is not whole how far it can be drawn.
fn tell_status(run: &Run) {
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

/// The figures that are asked for, and those of the catalogue that the run does not have.
fn figures(
    options: &PlotOptions,
    runs: &[Run],
    chosen: &[&Entry],
) -> Result<(Vec<Figure>, Vec<NotDrawn>), CommandError> {
    if !options.channels.is_empty() || !options.phase.is_empty() {
        return own_figures(options, runs)
            .map(|figures| (figures, Vec::new()))
            .map_err(bad);
    }
    if options.from.is_some() || options.to.is_some() || options.x.is_some() {
        return Err(CommandError::Input(
            "--from, --to and --x are for figures of one's own; the figures of the paper find their windows by the \
             events. Name what to draw with --channel NAME or --phase A B"
                .to_owned(),
        ));
    }
    let Some(story) = Story::new(runs) else {
        return Ok((Vec::new(), Vec::new()));
    };
    let all: Vec<&Entry> = ENTRIES.iter().collect();
    let (mut figures, mut not_drawn) = (Vec::new(), Vec::new());
    for entry in if chosen.is_empty() { &all[..] } else { chosen } {
        match entry.build(&story).map_err(bad)? {
            Ok(figure) => figures.push(figure),
            Err(why) => not_drawn.push(NotDrawn {
                figure: entry.name,
                why,
            }),
        }
    }
    // What is asked for by name has to be there.
    if let (Some(missing), false) = (not_drawn.first(), chosen.is_empty()) {
        return Err(CommandError::Input(format!(
            "{}: {} cannot be drawn: {}",
            story.run.path().display(),
            missing.figure,
            missing.why
        )));
    }
    Ok((figures, not_drawn))
}

fn own_figures(options: &PlotOptions, runs: &[Run]) -> Result<Vec<Figure>, PlotError> {
    let window = own::window(runs, options.from, options.to)?;
    let mut figures = Vec::new();
    let title = |what: &str| match runs {
        [run] => format!("{what}, {}", run.label()),
        _ => what.to_owned(),
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
            figures.push(own::channels(runs, &title(&names.join(", ")), &channels, window)?);
        }
        None => {}
    }
    for pair in options.phase.chunks_exact(2) {
        figures.push(against(&pair[0], &pair[1])?);
    }
    Ok(figures)
}

/// Where each figure goes, in which format.
fn targets(options: &PlotOptions, figures: &[Figure]) -> Result<Vec<(usize, PathBuf, Format)>, PlotError> {
    if let Some(format) = Format::of_path(&options.output) {
        if figures.len() != 1 {
            return Err(PlotError::NoFolder {
                path: options.output.clone(),
            });
        }
        return Ok(vec![(0, options.output.clone(), format)]);
    }
    if options.output.is_file() {
        return Err(PlotError::NoFolder {
            path: options.output.clone(),
        });
    }
    let formats: &[Format] = match &options.format {
        Some(format) => std::slice::from_ref(format),
        None => &[Format::Svg, Format::Png],
    };
    let file = |name: &str, format: &Format| options.output.join(format!("{name}.{}", format.extension()));
    let of_figure = |(k, figure): (usize, &Figure)| -> Vec<(usize, PathBuf, Format)> {
        formats.iter().map(|f| (k, file(&figure.name, f), *f)).collect()
    };
    Ok(figures.iter().enumerate().flat_map(of_figure).collect())
}

fn write(options: &PlotOptions, figures: &[Figure]) -> Result<Vec<Written>, CommandError> {
    let targets = targets(options, figures).map_err(bad)?;
    for (_, path, _) in &targets {
        check_target(path, &options.files, options.force)?;
    }
    if Format::of_path(&options.output).is_none() && !targets.is_empty() {
        std::fs::create_dir_all(&options.output).map_err(|source| {
            bad(PlotError::Io {
                path: options.output.clone(),
                action: "creating the folder",
                source,
            })
        })?;
    }
    let mut written = Vec::with_capacity(targets.len());
    let mut drawn: Option<(usize, String)> = None;
    for (number, path, format) in targets {
        let figure = &figures[number];
        let text = match drawn.take().filter(|(of, _)| *of == number) {
            Some((_, text)) => text,
            None => svg::svg(figure, options.width).map_err(bad)?,
        };
        save(&path, &text, format, options.dpi).map_err(bad)?;
        written.push(Written {
            file: path.display().to_string(),
            figure: figure.name.clone(),
            title: figure.full_title(),
            paper_figure: figure.paper_figure,
        });
        drawn = Some((number, text));
    }
    Ok(written)
}

/// Also by force an input is never an output.
pub(super) fn check_target(path: &Path, inputs: &[PathBuf], force: bool) -> Result<(), CommandError> {
    let same = |input: &PathBuf| matches!((input.canonicalize(), path.canonicalize()), (Ok(a), Ok(b)) if a == b);
    if inputs.iter().any(same) {
        return Err(CommandError::Input(format!(
            "{}: this is the file to be drawn; give the figure another name with -o",
            path.display()
        )));
    }
    target::check(path, force).map_err(bad)
}

/// Writes one figure in one format.
pub(super) fn save(path: &Path, svg: &str, format: Format, dpi: f64) -> Result<(), PlotError> {
    match format {
        Format::Svg => target::write(path, svg.as_bytes()),
        Format::Png => target::write(path, &raster::png(svg, dpi)?),
    }
}

fn report(written: &[Written], not_drawn: &[NotDrawn]) -> String {
    let mut lines: String = written.iter().map(|w| format!("{}\n", w.file)).collect();
    if !not_drawn.is_empty() {
        lines += "\nnot drawn:\n";
    }
    for missing in not_drawn {
        lines += &format!("{}: {}\n", missing.figure, missing.why);
    }
    lines
}
