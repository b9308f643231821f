//! Earlier files at the place of a new one. Without force, a file is replaced only by a result of the same case and
//! settings.

use std::path::Path;
use stickslip_case::{OtherSetting, differences};
use stickslip_files::{
    AttributeValue, FileKind, Overwrite, Reason, ResultError, ResultFile, ShardFile, ShardPlan, StudyFile, StudyHeader,
    schema,
};

/// Most differences that a message lists.
const LISTED: usize = 3;

/// Refuses to replace the file at `path` if it holds the run of another case or other settings. `resolved` is the
/// resolved case of the new run. A partial file, which is of a run that has no result, is replaced by the next run.
///
/// # Errors
/// Such a file exists, and there is no force.
pub fn spare_run(path: &Path, overwrite: Overwrite, kind: FileKind, resolved: &str) -> Result<(), ResultError> {
    spare(path, overwrite, kind, |file| {
        let settings = ResultFile::open(file).ok()?.settings().ok()?;
        let mut found = settings.iter().map(|there| differences(there, resolved));
        let first = found.next()?;
        match first.is_empty() || found.any(|others| others.is_empty()) {
            true => None,
            false => Some(listed(&first)),
        }
    })
}

/// Refuses to replace the certificate at `path` by a weaker one: one without exact events, or with fewer digits of the
/// least known event. `by_oracle`: whether the new one has exact events. `digits` are those of the new one; `None`
/// before they are known.
///
/// # Errors
/// There is a better certificate, and there is no force.
pub fn spare_certificate(
    path: &Path,
    overwrite: Overwrite,
    by_oracle: bool,
    digits: Option<u32>,
) -> Result<(), ResultError> {
    if overwrite == Overwrite::Force || FileKind::of(path) != Some(FileKind::CertifiedRun) {
        return Ok(());
    }
    let Some((exact, there)) = certificate(path) else {
        return Ok(());
    };
    let better = match digits {
        _ if exact && !by_oracle => "which has exact events; the new one has none without --oracle".to_owned(),
        Some(here) if exact == by_oracle && there.is_some_and(|there| there > here) => format!(
            "which has {} digits of the least known event; the new one has {here}",
            there.unwrap_or(0)
        ),
        _ => return Ok(()),
    };
    Err(Reason::Another(format!("a better certificate, {better}")).of(path))
}

/// Whether the certificate of a file has exact events, and its digits of the least known event.
fn certificate(path: &Path) -> Option<(bool, Option<u32>)> {
    let file = ResultFile::open(path).ok()?;
    let by = file.group_text(schema::group::CERTIFICATE, "uncertainty_by").ok()??;
    if by == "oracle" {
        let table = file.text_variable(schema::group::CERTIFICATE, "oracle").ok()??;
        let times = table.lines().skip(1).filter_map(|line| line.split(',').next());
        return Some((true, times.map(digits_of).min()));
    }
    let group = file.added_group(schema::group::CERTIFICATE, 0).ok()??;
    let digits = group.attributes.into_iter().find(|(name, _)| name == "digits");
    match digits {
        Some((_, AttributeValue::Number(digits))) if digits >= 0.0 => Some((false, Some(digits as u32))),
        _ => Some((false, None)),
    }
}

/// Significant digits of a decimal as it is written.
fn digits_of(decimal: &str) -> u32 {
    let mantissa = decimal.split(['e', 'E']).next().unwrap_or_default();
    let digits = mantissa.chars().filter(char::is_ascii_digit);
    let significant = digits.skip_while(|digit| *digit == '0').count();
    match significant {
        // An exact zero
        0 => u32::MAX,
        count => count as u32,
    }
}

/// The same for the file of a study, of which `shard` is a part. `digest` is that of the study, if its files have one.
pub(crate) fn spare_study(
    path: &Path,
    overwrite: Overwrite,
    kind: FileKind,
    header: &StudyHeader,
    digest: Option<&str>,
    shard: Option<&ShardPlan>,
) -> Result<(), ResultError> {
    spare(path, overwrite, kind, |file| {
        let earlier = EarlierStudy::read(file)?;
        if let (Some(here), Some(there)) = (shard, earlier.shard)
            && here.shard != there
        {
            return Some(format!("part {} there, {} here", there + 1, here.shard + 1));
        }
        if digest.is_some() && earlier.digest.as_deref() == digest {
            return None;
        }
        let mut found = differences(&earlier.study, &header.study);
        for (name, _, here) in &header.inputs {
            let there = earlier.inputs.iter().find(|(known, _)| known == name);
            found.extend(there.iter().flat_map(|(_, there)| differences(there, here)));
        }
        found.extend(changed(&earlier.changed, &header.changed));
        match found.is_empty() {
            // Another version of the program has another digest.
            true if earlier.source != header.source => None,
            true => digest.map(|_| "its settings differ".to_owned()),
            false => Some(listed(&found)),
        }
    })
}

struct EarlierStudy {
    source: String,
    study: String,
    inputs: Vec<(&'static str, String)>,
    changed: Vec<String>,
    digest: Option<String>,
    shard: Option<usize>,
}

impl EarlierStudy {
    fn read(path: &Path) -> Option<EarlierStudy> {
        let open = |format| StudyFile::open(path, format).ok();
        let shard = ShardFile::open(path).ok();
        let formats = [
            schema::SWEEP_FORMAT,
            schema::SWEEP_SHARD_FORMAT,
            schema::CONTINUATION_FORMAT,
            schema::WORK_PRECISION_FORMAT,
        ];
        let file = formats.into_iter().find_map(open)?;
        let inputs = ["case", "settings", schema::INPUT_RESOLVED];
        let inputs = inputs
            .into_iter()
            .filter_map(|name| Some((name, file.input(name).ok()??)));
        Some(EarlierStudy {
            source: file.text(schema::root::SOURCE).ok()?.unwrap_or_default(),
            study: file.input("study").ok()??,
            inputs: inputs.collect(),
            changed: file.changed(),
            digest: file.digest().ok()?.or(file.text("meta/study_digest").ok()?),
            shard: shard.map(|shard| shard.shard()),
        })
    }
}

/// Differences between overrides in words.
fn changed(there: &[String], here: &[String]) -> Vec<OtherSetting> {
    let value = |lines: &[String], key: &str| {
        let mut found = lines.iter().filter_map(|line| line.split_once(" = "));
        found.find_map(|(known, value)| (known == key).then(|| value.to_owned()))
    };
    let keys = here
        .iter()
        .chain(there)
        .filter_map(|line| Some(line.split_once(" = ")?.0));
    let mut found: Vec<OtherSetting> = Vec::new();
    for key in keys {
        let (there, here) = (value(there, key), value(here, key));
        if there != here && found.iter().all(|known| known.key != key) {
            let key = key.to_owned();
            found.push(OtherSetting { key, there, here });
        }
    }
    found
}

fn listed(found: &[OtherSetting]) -> String {
    let mut texts: Vec<String> = found.iter().take(LISTED).map(ToString::to_string).collect();
    if found.len() > LISTED {
        texts.push(format!("and {} more", found.len() - LISTED));
    }
    texts.join("; ")
}

fn spare(
    path: &Path,
    overwrite: Overwrite,
    kind: FileKind,
    differs: impl Fn(&Path) -> Option<String>,
) -> Result<(), ResultError> {
    if overwrite == Overwrite::Force {
        return Ok(());
    }
    let Some(found) = FileKind::of(path) else { return Ok(()) };
    let name = found.name();
    match differs(path) {
        _ if !kind.includes(found) => Err(Reason::Another(format!("a {name}")).of(path)),
        Some(how) => Err(Reason::Another(format!("another {name}: {how}")).of(path)),
        None => Ok(()),
    }
}
