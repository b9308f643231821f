//! Assignment of a candidate's columns to channels and units.

use super::super::{Channel, CompareError, Vocabulary};
use std::path::{Path, PathBuf};
use stickslip_case::quantity::{self, Dimension};
use stickslip_case::suggest;
use stickslip_system::quote::shown;
use stickslip_system::record::EventKind;
use toml_edit::{Document, Item};

/// A column of a candidate.
#[derive(Debug, Clone, PartialEq)]
pub struct MappedColumn {
    /// A header of a CSV file, a member of an NPZ file, or a path in an HDF5 file; `NAME[2]`, `NAME[2,:]` or
    /// `NAME[:,2]` is a row or column of a two-dimensional array.
    pub name: String,
    /// Conversion factor to the SI unit; `None` if the unit is not given.
    pub factor: Option<f64>,
    /// Whether the values have the opposite sign.
    pub negated: bool,
}

impl MappedColumn {
    /// 1, or -1 for values of the opposite sign.
    pub(super) fn sign(&self) -> f64 {
        if self.negated { -1.0 } else { 1.0 }
    }
}

/// Time added to a candidate's times, because its clock may start elsewhere.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum TimeOffset {
    /// Nothing is added; if the events show an offset, it is proposed.
    #[default]
    None,
    /// A given offset, s.
    Seconds(f64),
    /// The offset with which most events agree.
    Auto,
}

impl TimeOffset {
    fn parse(text: &str) -> Result<TimeOffset, String> {
        if text.trim() == "auto" {
            return Ok(TimeOffset::Auto);
        }
        TimeOffset::seconds(with_or_without_unit(text, Dimension::Time)?)
    }

    fn seconds(value: f64) -> Result<TimeOffset, String> {
        match value.is_finite() {
            true => Ok(TimeOffset::Seconds(value)),
            false => Err(format!("an offset is a number of seconds, or \"auto\", not {value}")),
        }
    }
}

/// Columns, units and options of a candidate.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Mapping {
    /// The column of times.
    pub time: Option<MappedColumn>,
    /// Columns of channels.
    pub channels: Vec<(Channel, MappedColumn)>,
    /// The column of event times.
    pub event_time: Option<MappedColumn>,
    /// The column of event kinds.
    pub event_kind: Option<MappedColumn>,
    /// Separate file with the events.
    pub event_file: Option<PathBuf>,
    /// The candidate's names of the kinds of events.
    pub kinds: Vec<(String, EventKind)>,
    /// A relative velocity up to this, rad/s, counts as zero.
    pub velocity_tolerance: Option<f64>,
    /// A stick ends where the relative velocity exceeds this many tolerances.
    pub hysteresis: Option<f64>,
    /// Time added to the candidate's times.
    pub time_offset: TimeOffset,
    /// Skips the search for causes.
    pub quick: bool,
    /// Wall time after which the search for a candidate's causes ends, s; `None` is 600 s.
    pub max_wall_time: Option<f64>,
    /// Names and dimensions of the channels, from the reference.
    pub vocabulary: Vocabulary,
}

fn parse_column(text: &str, unit: Option<&str>, dimension: Dimension) -> Result<MappedColumn, String> {
    let factor = unit.map(|unit| factor(unit, dimension)).transpose()?;
    let negated = text.strip_prefix('-').map(str::trim_start);
    Ok(MappedColumn {
        name: negated.unwrap_or(text).to_owned(),
        factor,
        negated: negated.is_some(),
    })
}

/// Conversion factor of `unit` to SI; UDUNITS powers ("rad s-1") are accepted.
pub(super) fn factor(unit: &str, dimension: Dimension) -> Result<f64, String> {
    let mut plain = String::with_capacity(unit.len() + 2);
    let mut last = ' ';
    for c in unit.chars() {
        if c == '-' && last.is_alphabetic() {
            plain.push('^');
        }
        plain.push(c);
        last = c;
    }
    quantity::factor(&plain, dimension)
}

impl Mapping {
    /// Takes the columns `time` and `kind` as events, whatever else the table has, unless the mapping says otherwise.
    pub(super) fn stated(mut self) -> Mapping {
        let column = |name: &str| MappedColumn {
            name: name.to_owned(),
            factor: None,
            negated: false,
        };
        if self.event_file.is_none() && self.event_time.is_none() && self.event_kind.is_none() {
            (self.event_time, self.event_kind) = (Some(column("time")), Some(column("kind")));
        }
        self
    }

    /// Applies a mapping file on top of this mapping.
    ///
    /// # Errors
    /// If it cannot be read, is no TOML, or has an unknown key, channel or unit.
    pub fn with_file(self, path: &Path) -> Result<Mapping, CompareError> {
        let text = stickslip_case::input::text(path).map_err(CompareError::io(path))?;
        let text = text.map_err(|line| {
            let what = "not a mapping: expected TOML, which is UTF-8 text";
            let place = line.map_or_else(String::new, |line| format!("line {line}"));
            CompareError::content(path, place, what, "save the file as UTF-8")
        })?;
        let document = Document::parse(text.as_str()).map_err(|error| {
            let line = error.span().map_or(1, |span| line_of(&text, span.start));
            let what = format!("not TOML: {}", error.message().trim());
            CompareError::content(path, format!("line {line}"), what, "correct the mapping")
        })?;
        let mut mapping = self;
        for (key, item) in document.iter() {
            let line = item.span().map_or(1, |span| line_of(&text, span.start));
            let remedy = "docs/reference/compare.md shows a mapping";
            let fault = |what| CompareError::content(path, format!("line {line}"), what, remedy);
            mapping.entry(key, item).map_err(fault)?;
        }
        if let Some(events) = &mapping.event_file
            && events.is_relative()
        {
            mapping.event_file = Some(path.parent().unwrap_or(Path::new("")).join(events));
        }
        Ok(mapping)
    }

    fn entry(&mut self, path: &str, item: &Item) -> Result<(), String> {
        match path {
            "time" => self.time = Some(column(item, path, Dimension::Time)?),
            "events.time" => self.event_time = Some(column(item, path, Dimension::Time)?),
            "time_offset" => {
                self.time_offset = match number(item) {
                    Some(seconds) => TimeOffset::seconds(seconds)?,
                    None => TimeOffset::parse(text(item, path)?)?,
                };
            }
            "channels" | "events" | "detection" | "events.kinds" => {
                let table = item
                    .as_table_like()
                    .ok_or_else(|| format!("{path} is a table, written [{path}]"))?;
                for (name, item) in table.iter() {
                    self.entry(&format!("{path}.{name}"), item)?;
                }
            }
            "events.kind" => self.event_kind = Some(parse_column(text(item, path)?, None, Dimension::Number)?),
            "events.file" => self.event_file = Some(text(item, path)?.into()),
            "detection.velocity_tolerance" => self.velocity_tolerance = Some(velocity(item, self.velocity())?),
            "detection.hysteresis" => self.set_hysteresis(number(item).unwrap_or(f64::NAN))?,
            _ => {
                if let Some(name) = path.strip_prefix("channels.") {
                    let channel = self.known_channel(name)?;
                    self.add(channel, column(item, name, self.vocabulary.dimension(channel))?);
                } else if let Some(theirs) = path.strip_prefix("events.kinds.") {
                    self.kinds.push((theirs.to_owned(), known_kind(text(item, theirs)?)?));
                } else if let Some(name) = path.strip_prefix("events.") {
                    return Err(unknown("events", name, &["time", "kind", "file", "kinds"]));
                } else if let Some(name) = path.strip_prefix("detection.") {
                    return Err(unknown("detection", name, &["velocity_tolerance", "hysteresis"]));
                } else {
                    let known = ["time", "time_offset", "channels", "events", "detection"];
                    return Err(unknown("the mapping", path, &known));
                }
            }
        }
        Ok(())
    }

    /// Adds `CHANNEL=COLUMN` or `CHANNEL=COLUMN:UNIT`, as on the command line. The channel may also be `time`,
    /// `events.time` or `events.kind`. A minus sign before the column reads its values with the opposite sign.
    pub fn add_option(&mut self, option: &str) -> Result<(), CompareError> {
        let fault = |what: String| CompareError::Option(format!("--column {option}: {what}"));
        let (name, rest) = option.split_once('=').ok_or_else(|| {
            fault("expected CHANNEL=COLUMN or CHANNEL=COLUMN:UNIT, such as relative_velocity=w:rpm".to_owned())
        })?;
        let (column, unit) = match rest.rsplit_once(':') {
            Some((column, unit)) if !unit.contains(']') => (column, Some(unit.trim())),
            _ => (rest, None),
        };
        let (name, column) = (name.trim().replace('-', "_"), column.trim());
        let parse = |dimension| parse_column(column, unit, dimension).map_err(fault);
        match &*name {
            "time" | "t" => self.time = Some(parse(Dimension::Time)?),
            "events.time" => self.event_time = Some(parse(Dimension::Time)?),
            "events.kind" => self.event_kind = Some(parse(Dimension::Number)?),
            _ => {
                let channel = self.known_channel(&name).map_err(fault)?;
                self.add(channel, parse(self.vocabulary.dimension(channel))?);
            }
        }
        Ok(())
    }

    /// Sets the velocity tolerance from a text with or without a unit.
    pub fn set_tolerance(&mut self, text: &str) -> Result<(), CompareError> {
        let value = with_or_without_unit(text, self.velocity()).and_then(not_negative);
        self.velocity_tolerance = Some(value.map_err(of_option("--velocity-tolerance"))?);
        Ok(())
    }

    /// Sets the time added to the candidate's times: a number of seconds, a time with its unit, or `auto`.
    pub fn set_time_offset(&mut self, text: &str) -> Result<(), CompareError> {
        self.time_offset = TimeOffset::parse(text).map_err(of_option("--time-offset"))?;
        Ok(())
    }

    /// Sets the wall time after which the search for causes ends, from a text with or without a unit.
    ///
    /// # Errors
    /// If it is no positive time.
    pub fn set_max_wall_time(&mut self, text: &str) -> Result<(), CompareError> {
        let value = with_or_without_unit(text, Dimension::Time).and_then(|value| match value > 0.0 {
            true => Ok(value),
            false => Err(format!("a wall time is a positive number of seconds, not {value}")),
        });
        self.max_wall_time = Some(value.map_err(of_option("--max-wall-time"))?);
        Ok(())
    }

    /// Sets the factor of the tolerance above which a stick ends.
    ///
    /// # Errors
    /// Below 1, or no number.
    pub fn set_hysteresis(&mut self, factor: f64) -> Result<(), String> {
        if !(1.0..=1e9).contains(&factor) {
            return Err("the hysteresis is how many tolerances end a stick: give a number of at least 1".to_owned());
        }
        self.hysteresis = Some(factor);
        Ok(())
    }

    fn velocity(&self) -> Dimension {
        self.vocabulary.motion().dimension(Dimension::AngularVelocity)
    }

    fn known_channel(&self, name: &str) -> Result<Channel, String> {
        self.vocabulary.find(name).ok_or_else(|| {
            let names: Vec<String> = self.vocabulary.channels().map(|c| c.name().into_owned()).collect();
            let names: Vec<&str> = names.iter().map(String::as_str).collect();
            unknown("the channels", name, &names)
        })
    }

    fn add(&mut self, channel: Channel, column: MappedColumn) {
        self.channels.retain(|(known, _)| *known != channel);
        self.channels.push((channel, column));
    }
}

fn of_option(name: &'static str) -> impl Fn(String) -> CompareError {
    move |what| CompareError::Option(format!("{name}: {what}"))
}

fn line_of(text: &str, offset: usize) -> usize {
    text[..offset.min(text.len())].matches('\n').count() + 1
}

fn text<'a>(item: &'a Item, key: &str) -> Result<&'a str, String> {
    item.as_str().ok_or_else(|| format!("{key} is a text in quotes"))
}

fn number(item: &Item) -> Option<f64> {
    item.as_float().or_else(|| item.as_integer().map(|n| n as f64))
}

fn with_or_without_unit(text: &str, dimension: Dimension) -> Result<f64, String> {
    let number = text.trim().parse::<f64>();
    number.or_else(|_| quantity::parse(text, dimension))
}

fn column(item: &Item, key: &str, dimension: Dimension) -> Result<MappedColumn, String> {
    if let Some(name) = item.as_str() {
        return parse_column(name, None, dimension);
    }
    let fault = || format!("{key} is a name in quotes, or {{ name = \"...\", unit = \"...\" }}");
    let table = item.as_table_like().ok_or_else(fault)?;
    if let Some((other, _)) = table.iter().find(|(key, _)| !matches!(*key, "name" | "unit")) {
        return Err(unknown(key, other, &["name", "unit"]));
    }
    let name = table.get("name").and_then(Item::as_str);
    let unit = table.get("unit").map(|unit| text(unit, "unit")).transpose()?;
    parse_column(name.ok_or_else(|| format!("{key} has no name"))?, unit, dimension)
        .map_err(|what| format!("{key}: {what}"))
}

fn velocity(item: &Item, dimension: Dimension) -> Result<f64, String> {
    let of_text = || item.as_str().map(|text| quantity::parse(text, dimension));
    let value = number(item).map(Ok).or_else(of_text);
    let unit = dimension.unit();
    not_negative(value.ok_or_else(|| format!("velocity_tolerance is a number in {unit}, or a text with a unit"))??)
}

fn not_negative(value: f64) -> Result<f64, String> {
    match value.is_finite() && value >= 0.0 {
        true => Ok(value),
        false => Err(format!("a velocity tolerance is a number of at least 0, not {value}")),
    }
}

pub(super) fn known_kind(name: &str) -> Result<EventKind, String> {
    let lower = name.trim().to_lowercase();
    let kind = EventKind::ALL.into_iter().find(|kind| kind.name() == lower);
    kind.ok_or_else(|| {
        let known = EventKind::ALL.map(EventKind::name).join(", ");
        format!("unknown kind of event \"{}\"; there are {known}", shown(name))
    })
}

fn unknown(place: &str, name: &str, known: &[&str]) -> String {
    let hint = match suggest(name, known.iter().copied()) {
        Some(close) => format!("did you mean {close}?"),
        None => format!("there are {}", known.join(", ")),
    };
    format!("{place}: unknown name \"{}\"; {hint}", shown(name))
}
