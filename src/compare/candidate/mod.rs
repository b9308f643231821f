//! Results of other solvers, in any of the formats that are read.
//!
//! | module | what it is |
//! |---|---|
//! | `source` | the file, which is read several times |
//! | `table`, `named` | a file as columns of numbers; columns that have paths for names |
//! | `csv`, `npz`, `hdf5`, `t01`, `binout`, `xy_report` | the formats |
//! | `mapping`, `rows` | which column is which channel; rows in SI units |
//! | `events` | tables of events |

mod binout;
mod csv;
pub(super) mod events;
mod hdf5;
mod mapping;
mod named;
mod npz;
pub(super) mod plain;
mod rows;
mod source;
mod t01;
mod table;
mod xy_report;

pub use mapping::{Column, Mapping, TimeOffset};
pub(super) use rows::{Block, Rows};

use super::attractor::Attractor;
use super::case_differences::{CaseDifference, case_differences};
use super::reference::Physics;
use super::resolution::{Clock, Digital, Rounding};
use super::{Channel, CompareError, Found, saved_case};
use crate::case::quantity::Dimension;
use crate::model::system::Pressing;
use crate::quote::shown;
use crate::results::{ForeignFile, Reason, ResultFile, check_sound};
use binout::BinoutTable;
use csv::CsvTable;
use hdf5::{ForeignTable, OwnTable};
use npz::NpzTable;
use rows::Supply;
use source::Source;
use std::path::{Path, PathBuf};
use t01::T01Table;
use table::{LeftOut, Table, unread};
use xy_report::XyReport;

/// Bytes by which a format is known.
const HEAD: u64 = 512;

/// Names of the column of times where nothing else is said.
const TIME_NAMES: [&str; 4] = ["time", "t", "times", "trajectory/time"];

/// A result of another solver, opened and understood but not yet read.
#[derive(Debug)]
pub(crate) struct Candidate {
    pub path: PathBuf,
    /// "result file", "HDF5", "CSV", "NPZ", "OpenRadioss T01", "LS-DYNA binout", "Abaqus XY report" or "events table".
    pub format: &'static str,
    table: Option<Box<dyn Table>>,
    /// The columns that are read; the first one is the time.
    columns: Vec<String>,
    pub clock: Clock,
    /// How the values of the columns stand in the file.
    digital: Vec<Digital>,
    supplies: Vec<Supply>,
    direct: Vec<Channel>,
    /// What of the file cannot be read, and what has the name of a channel and is no column.
    left_out: Vec<LeftOut>,
    /// Those of the sequence, if it has any table of them.
    pub events: Option<Vec<Found>>,
    /// To what the times of its events are rounded where they are stated.
    pub events_rounding: Option<Rounding>,
    /// Of one of this program's results: the keys in which its case differs from the reference's.
    differences: Option<Vec<CaseDifference>>,
    /// The periodic motion that one of this program's results has come to.
    pub attractor: Option<Attractor>,
}

impl Candidate {
    /// Opens a candidate.
    ///
    /// # Errors
    /// If it is of no known format, damaged, lacks a time column, has neither events nor a relative velocity, or if
    /// the mapping names what it does not have.
    pub fn open(path: &Path, mapping: &Mapping, physics: &Physics) -> Result<Candidate, CompareError> {
        let source = Source::open(path)?;
        let head = source.head(HEAD)?;
        if head.starts_with(b"\x89HDF") {
            refuse_pipe(&source)?;
            match ResultFile::open(path) {
                Ok(file) => {
                    check_sound(path)?;
                    return Candidate::own(path, file, physics);
                }
                Err(error) if matches!(error.reason, Reason::NotAResult(_)) => {}
                Err(error) => return Err(error.into()),
            }
        }
        let (format, table) = table_of(source, &head)?;
        Candidate::foreign(path, format, table, mapping, physics)
    }

    /// One of this program's results.
    fn own(path: &Path, file: ResultFile, physics: &Physics) -> Result<Candidate, CompareError> {
        let case = saved_case(path, &file)?;
        let events = file.events()?;
        let refuse = |what: &str, remedy: &str| Err(CompareError::whole(path, what, remedy));
        let case = &case;
        let system = &case.system;
        if case.motion() != physics.vocabulary().motion() {
            let what = "is a run of another motion than the reference: one is of rotation, one of translation";
            return refuse(what, "compare runs of one motion");
        }
        let axial = matches!(system.pressing, Pressing::Axial { .. });
        let is_there = |channel: &Channel| match channel {
            _ if channel.is_axial() => axial,
            _ => file.column(&channel.name(), 0..0).is_ok(),
        };
        let mut candidate = Candidate::empty(path, "result file");
        candidate.columns.push("time".to_owned());
        for channel in physics.vocabulary().channels().filter(is_there) {
            candidate.take(channel, channel.name().into_owned(), 1.0);
        }
        candidate.events = Some(events::own(path, &events, system.radius)?);
        candidate.differences = Some(case_differences(&physics.case, case));
        candidate.attractor = Attractor::of_file(&file)?;
        candidate.table = Some(Box::new(OwnTable { file }));
        Ok(candidate)
    }

    /// Of which nothing is known yet.
    fn empty(path: &Path, format: &'static str) -> Candidate {
        Candidate {
            path: path.to_owned(),
            format,
            columns: Vec::new(),
            clock: Clock::seconds(),
            digital: Vec::new(),
            events_rounding: None,
            supplies: Vec::new(),
            direct: Vec::new(),
            left_out: Vec::new(),
            events: None,
            differences: None,
            attractor: None,
            table: None,
        }
    }

    /// Takes a channel from a column, whose unit is so many SI units.
    fn take(&mut self, channel: Channel, column: String, factor: f64) {
        self.supplies.push(Supply::direct(channel, factor, self.columns.len()));
        self.columns.push(column);
        self.direct.push(channel);
    }

    fn foreign(
        path: &Path,
        format: &'static str,
        table: Box<dyn Table>,
        mapping: &Mapping,
        physics: &Physics,
    ) -> Result<Candidate, CompareError> {
        let mut candidate = Candidate::empty(path, format);
        candidate.left_out = table.left_out().to_vec();
        for channel in physics.vocabulary().channels() {
            if let Some((name, factor)) = candidate.find(&*table, channel, mapping, physics)? {
                if candidate.columns.is_empty() {
                    candidate.find_time(&*table, mapping, &name)?;
                }
                candidate.take(channel, name, factor);
            }
        }
        rows::derive(&mut candidate.supplies, physics);
        if let Some((events, rounding)) = events::find(&*table, mapping, candidate.direct.is_empty())? {
            candidate.events = Some(events);
            candidate.events_rounding = rounding;
        }
        if candidate.direct.is_empty() {
            if candidate.events.is_none() {
                let what = format!(
                    "no column is known as a channel; there are {}",
                    candidate.there(&*table)
                );
                let remedy = "say which column is what, such as --column relative_velocity=NAME:rad/s, or in a mapping";
                return Err(CompareError::whole(path, what, remedy));
            }
            candidate.format = "events table";
        } else {
            candidate.look_at_digits(&*table)?;
            candidate.table = Some(table);
        }
        if candidate.events.is_none() && !candidate.has(Channel::RelativeVelocity) {
            let given: Vec<_> = candidate.direct.iter().map(|c| c.name()).collect();
            let what = format!(
                "has neither events nor a relative velocity to find them by, but {}{}",
                given.join(", "),
                candidate.without()
            );
            let speeds = physics.vocabulary().surface_speeds();
            let remedy = format!("add relative_velocity, or {speeds}, or a table of events");
            return Err(CompareError::whole(path, what, &remedy));
        }
        Ok(candidate)
    }

    /// To what the numbers of the file seem to be rounded, by its first rows.
    fn look_at_digits(&mut self, table: &dyn Table) -> Result<(), CompareError> {
        let of_texts = table.roundings(&self.columns)?;
        let mut first = vec![Vec::new(); self.columns.len()];
        table.pass(&self.columns)?(&mut first)?;
        let columns = first.iter().zip(&of_texts);
        self.digital = columns
            .map(|(values, of_texts)| Digital::of(values, *of_texts))
            .collect();
        let single = Some(Rounding::Single).filter(|single| first[0].len() > 2 && single.hold(&first[0]));
        self.clock.rounding = of_texts[0].or(single);
        Ok(())
    }

    fn find_time(&mut self, table: &dyn Table, mapping: &Mapping, beside: &str) -> Result<(), CompareError> {
        let mapped = mapping.time.as_ref();
        let name = match (mapped, table.time_beside(beside)) {
            (Some(column), _) => Some(self::mapped(table, "time", &column.name)?),
            (None, Some(name)) => Some(name),
            (None, None) => only(table, "time", &TIME_NAMES, &|_| false)?,
        };
        let name = name.ok_or_else(|| {
            self.leave_out(table, &TIME_NAMES);
            let what = format!("has no column of times; there are {}", self.there(table));
            let remedy = "name it with --column time=NAME or in a mapping";
            CompareError::whole(&self.path, what, remedy)
        })?;
        self.clock.factor = unit_factor(table, &name, mapped, Dimension::Time)?;
        self.columns.push(name);
        Ok(())
    }

    /// The column of a channel with its factor to SI: as the mapping says, or by its name.
    fn find(
        &mut self,
        table: &dyn Table,
        channel: Channel,
        mapping: &Mapping,
        physics: &Physics,
    ) -> Result<Option<(String, f64)>, CompareError> {
        let vocabulary = physics.vocabulary();
        let mut of_mapping = mapping.channels.iter();
        let mapped = of_mapping.find(|(known, _)| vocabulary.canonical(*known) == Some(channel));
        let mapped = mapped.map(|(_, column)| column);
        let taken = |name: &str| mapping.channels.iter().any(|(_, column)| column.name == name);
        let own = channel.name();
        let names = vocabulary.names(channel).iter().map(String::as_str);
        // The z of the bristles is that of the axial motion in a file that has their own name.
        let is_axial = |name: &str| name == "z" && name != own && table.has(&own);
        let is_name = |name: &&str| table.recognises(name) && !taken(name) && !is_axial(name);
        let names: Vec<&str> = names.filter(is_name).collect();
        let name = match mapped {
            Some(column) => Some(self::mapped(table, &own, &column.name)?),
            None => {
                // The program's own files have some channels twice.
                let of_file = |name: &&&str| vocabulary.is_own_name(channel, name) && table.has(name);
                match names.iter().filter(of_file).count() > 1 {
                    true => names.iter().find(of_file).map(|name| (*name).to_owned()),
                    false => only(table, &own, &names, &taken)?,
                }
            }
        };
        let Some(name) = name else {
            self.leave_out(table, &names);
            return Ok(None);
        };
        if table.is_impulse(&name) && !channel.is_impulse() {
            let what = format!("{} is an impulse, the integral of a force over time", shown(&name));
            let remedy = "name it as normal_impulse or friction_impulse";
            return Err(CompareError::content(table.path(), channel.name(), what, remedy));
        }
        let factor = unit_factor(table, &name, mapped, vocabulary.dimension(channel))?;
        Ok(Some((name, factor)))
    }

    /// Notes what the file has by these names that is no column.
    fn leave_out(&mut self, table: &dyn Table, names: &[&str]) {
        let found = names.iter().filter_map(|name| unread(table, name));
        for left_out in found {
            if !self.left_out.iter().any(|known| known.name == left_out.name) {
                self.left_out.push(left_out);
            }
        }
    }

    /// What of the file is no column, and why.
    pub fn left_out(&self) -> impl Iterator<Item = (&str, &str)> {
        self.left_out.iter().map(|one| (&*one.name, &*one.why))
    }

    /// The same in a message.
    fn without(&self) -> String {
        let one = |one: &LeftOut| format!("{} {} ({})", shown(&one.name), one.why, one.remedy);
        let all: Vec<String> = self.left_out.iter().take(MOST_NAMED).map(one).collect();
        let more = if self.left_out.len() > MOST_NAMED { "; ..." } else { "" };
        match all.is_empty() {
            true => String::new(),
            false => format!("; left out: {}{more}", all.join("; ")),
        }
    }

    /// The columns of a table, and why others are not among them.
    fn there(&self, table: &dyn Table) -> String {
        listed(&table.names()) + &self.without()
    }

    /// Adds a time (s) to all of its times.
    pub fn shift(&mut self, offset: f64) {
        self.clock.offset += offset;
        self.events.iter_mut().flatten().for_each(|event| event.time += offset);
    }

    /// Whether it is one of this program's results.
    pub fn is_own(&self) -> bool {
        self.differences.is_some()
    }

    /// The keys in which its case differs from the reference's, of one of this program's results.
    pub fn differences(&self) -> &[CaseDifference] {
        self.differences.as_deref().unwrap_or_default()
    }

    /// Whether it is a time series, and not a table of events alone.
    pub(crate) fn has_rows(&self) -> bool {
        self.table.is_some()
    }

    /// The channels that it has or that follow from them, in the order of the reference's.
    pub fn channels(&self, physics: &Physics) -> Vec<Channel> {
        let all = physics.vocabulary().channels();
        all.filter(|&channel| self.has(channel)).collect()
    }

    /// Whether a channel is there or follows from others.
    pub fn has(&self, channel: Channel) -> bool {
        self.supplies.iter().any(|supply| supply.channel == channel)
    }

    /// Whether a channel follows from its columns alone, without the motion of a driven end of the reference.
    pub fn is_its_own(&self, channel: Channel) -> bool {
        let supply = self.supplies.iter().find(|supply| supply.channel == channel);
        supply.is_some_and(|supply| !supply.is_of_drive())
    }

    /// What rounding in the file makes of a channel of this value at most; 0 of one that it does not have.
    pub fn rounding_of(&self, channel: Channel, value: f64) -> f64 {
        let supply = self.supplies.iter().find(|supply| supply.channel == channel);
        supply.map_or(0.0, |supply| supply.rounding(value, &self.digital))
    }

    /// The coarsest rounding of what `channels` follow from, in parts of the values; `None` of doubles.
    pub fn coarsest(&self, channels: &[Channel]) -> Option<Rounding> {
        let known = self.supplies.iter().filter(|supply| channels.contains(&supply.channel));
        let columns = known
            .flat_map(Supply::columns)
            .filter_map(|column| self.digital.get(column));
        let part = |digital: &&Digital| digital.error(digital.largest) / digital.largest;
        let rounded = columns.filter(|digital| digital.rounding.is_some());
        rounded.max_by(|a, b| part(a).total_cmp(&part(b)))?.rounding
    }

    /// Reads times and `channels`, which it must have, from the first row on.
    ///
    /// # Errors
    /// Of the file.
    pub fn rows<'a>(&'a self, channels: &[Channel], physics: &'a Physics) -> Result<Rows<'a>, CompareError> {
        let none = || {
            CompareError::whole(
                &self.path,
                "has events but no samples",
                "give a time series to compare states",
            )
        };
        let table = self.table.as_deref().ok_or_else(none)?;
        let supply = |channel: &Channel| self.supplies.iter().find(|supply| supply.channel == *channel).cloned();
        let supplies: Vec<Supply> = channels.iter().filter_map(supply).collect();
        Rows::new(table, &self.columns, &self.clock, supplies, physics)
    }
}

/// The name of a format, and a file of it as a table.
type OfFormat = (&'static str, Box<dyn Table>);

/// The file of another program, by its first bytes `head`.
fn table_of(source: Source, head: &[u8]) -> Result<OfFormat, CompareError> {
    if let Some(known) = hdf5_or_npz(&source, head)? {
        return Ok(known);
    }
    if t01::is_t01(head) {
        return Ok(("OpenRadioss T01", Box::new(T01Table::open(&source)?)));
    }
    if binout::is_binout(head) {
        return Ok(("LS-DYNA binout", Box::new(BinoutTable::open(&source)?)));
    }
    if xy_report::is_xy_report(head) {
        return Ok(("Abaqus XY report", Box::new(XyReport::open(source)?)));
    }
    let path = source.path();
    let text = String::from_utf8_lossy(head);
    for report in ["field output report", "probe values report"] {
        if text.trim_start().starts_with("****") && text.to_lowercase().contains(report) {
            let what = format!("is a {report} of Abaqus, values at one time");
            let remedy = "write a history: XY data from history output, and Report > XY";
            return Err(CompareError::whole(path, what, remedy));
        }
    }
    let is_named_hdf5 = ["h5", "hdf5", "nc"]
        .iter()
        .any(|known| path.extension().is_some_and(|end| end == *known));
    if is_named_hdf5 || head[..head.len().min(8)].contains(&0) {
        let what = "does not begin as an HDF5, NPZ or CSV file does";
        let remedy = "it was cut off or is of another format: give HDF5, NPZ, CSV, an OpenRadioss T01, an LS-DYNA binout or an \
                      Abaqus XY report";
        return Err(CompareError::whole(path, what, remedy));
    }
    Ok(("CSV", Box::new(CsvTable::open(source)?)))
}

/// The file of another program, if its first bytes are those of HDF5 or NPZ.
fn hdf5_or_npz(source: &Source, head: &[u8]) -> Result<Option<OfFormat>, CompareError> {
    if head.starts_with(b"\x89HDF") {
        refuse_pipe(source)?;
        check_sound(source.path())?;
        let file = ForeignFile::open(source.path())?;
        return Ok(Some(("HDF5", Box::new(ForeignTable::of(file)))));
    }
    if head.starts_with(b"PK") {
        return Ok(Some(("NPZ", Box::new(NpzTable::open(source)?))));
    }
    Ok(None)
}

/// HDF5 reads here and there in a file.
fn refuse_pipe(source: &Source) -> Result<(), CompareError> {
    if source.is_piped() {
        let remedy = "save it in a file, and name that";
        return Err(CompareError::whole(source.path(), "HDF5 came through a pipe", remedy));
    }
    Ok(())
}

/// The factor to SI: as the mapping says, as the file says, or 1.
fn unit_factor(
    table: &dyn Table,
    name: &str,
    mapped: Option<&Column>,
    dimension: Dimension,
) -> Result<f64, CompareError> {
    if let Some(factor) = mapped.and_then(|column| column.factor) {
        return Ok(factor);
    }
    let Some(unit) = table.unit(name) else {
        return Ok(1.0);
    };
    mapping::factor(&unit, dimension).map_err(|what| {
        let what = format!("its unit \"{}\": {what}", shown(&unit));
        let remedy = "say its unit in a mapping, or as --column CHANNEL=COLUMN:UNIT";
        CompareError::content(table.path(), name, what, remedy)
    })
}

/// The only column that some names mean, as they are or else nearly; `None` if there is none. `taken` are others'.
///
/// # Errors
/// If there are several.
fn only(
    table: &dyn Table,
    what: &str,
    names: &[&str],
    taken: &dyn Fn(&str) -> bool,
) -> Result<Option<String>, CompareError> {
    for exact in [true, false] {
        let mut found: Vec<String> = Vec::new();
        for column in names.iter().flat_map(|name| table.columns_of(name, exact)) {
            if !taken(&column) && !found.contains(&column) {
                found.push(column);
            }
        }
        if found.len() > 1 {
            let listed = listed(&found);
            let remedy = format!("say which it is with --column {what}=NAME or in a mapping");
            let several = format!("several columns have names of {what}: {listed}");
            return Err(CompareError::whole(table.path(), several, &remedy));
        }
        if found.len() == 1 {
            return Ok(found.pop());
        }
    }
    Ok(None)
}

/// The column that a mapping names.
fn mapped(table: &dyn Table, what: &str, name: &str) -> Result<String, CompareError> {
    if !table.has(name) {
        return Err(absent(table, name));
    }
    Ok(only(table, what, &[name], &|_| false)?.unwrap_or_else(|| name.to_owned()))
}

fn absent(table: &dyn Table, name: &str) -> CompareError {
    let remedy = "correct the mapping or the option --column";
    if let Some(why) = table.why_not(name) {
        return CompareError::whole(table.path(), why, remedy);
    }
    if let Some(left_out) = unread(table, name) {
        return left_out.error(table.path());
    }
    let names = table.names();
    let hint = match crate::case::suggest(name, names.iter().map(String::as_str)) {
        Some(close) => format!("did you mean {close}?"),
        None => format!("there are {}", listed(&names)),
    };
    let what = format!("has no column \"{name}\"; {hint}", name = shown(name));
    CompareError::whole(table.path(), what, remedy)
}

/// So many names are listed in a message.
const MOST_NAMED: usize = 20;

fn listed(names: &[String]) -> String {
    if names.is_empty() {
        return "no columns of numbers".to_owned();
    }
    let more = if names.len() > MOST_NAMED { ", ..." } else { "" };
    let shown: Vec<String> = names.iter().take(MOST_NAMED).map(|name| shown(name)).collect();
    shown.join(", ") + more
}
