//! Histories as explicit finite-element codes write them, from the formats' documentation: of the T01 the sources of OpenRadioss, of LSDA the
//! description of its library, of the XY report one that Abaqus wrote.

/// A record of Fortran, big-endian.
fn record(file: &mut Vec<u8>, contents: &[u8]) {
    let length = (contents.len() as u32).to_be_bytes();
    file.extend(length);
    file.extend(contents);
    file.extend(length);
}

fn integers(values: &[i32]) -> Vec<u8> {
    values.iter().flat_map(|value| value.to_be_bytes()).collect()
}

fn reals(values: &[f64]) -> Vec<u8> {
    values.iter().flat_map(|&value| (value as f32).to_be_bytes()).collect()
}

fn title(text: &str, length: usize) -> Vec<u8> {
    format!("{text:length$}").into_bytes()
}

/// A group of a T01: its type, its members with their titles, the numbers of its variables.
pub struct Group {
    pub of: i32,
    pub title: &'static str,
    pub members: Vec<(i32, &'static str)>,
    pub codes: Vec<i32>,
}

/// Title, date and what else stands in front of the states.
pub fn t01_head(version: i32, groups: &[Group]) -> Vec<u8> {
    let length = if version >= 3050 { 100 } else { 40 };
    let mut file = Vec::new();
    record(&mut file, &[integers(&[version]), title("BRAKE", 80)].concat());
    record(&mut file, &title("Sun Nov 22 21:00:00 2026 RADIOSS", 80));
    if version >= 3050 {
        record(&mut file, &integers(&[2]));
        record(&mut file, &integers(&[100]));
        record(&mut file, &reals(&[1.0, 1.0, 1.0]));
    }
    // One part, one material, one property, one subset.
    record(&mut file, &integers(&[1, 1, 1, 1, groups.len() as i32, 22]));
    record(&mut file, &integers(&(1..=22).collect::<Vec<i32>>()));
    record(
        &mut file,
        &[integers(&[1]), title("disk", length), integers(&[1, 1, 1, 2])].concat(),
    );
    record(&mut file, &integers(&[1, 2]));
    for name in ["steel", "solid"] {
        record(&mut file, &[integers(&[1]), title(name, length)].concat());
    }
    record(&mut file, &[integers(&[1, 0, 0, 1, 1]), title("all", length)].concat());
    record(&mut file, &integers(&[1]));
    record(&mut file, &integers(&[2]));
    for group in groups {
        let counts = [1, group.of, 1, group.members.len() as i32, group.codes.len() as i32];
        record(&mut file, &[integers(&counts), title(group.title, length)].concat());
        for (number, name) in &group.members {
            record(&mut file, &[integers(&[*number]), title(name, length)].concat());
        }
        record(&mut file, &integers(&group.codes));
    }
    file
}

/// A state: the time, and of each group the values of its members.
pub fn t01_state(file: &mut Vec<u8>, time: f64, groups: &[&[f64]]) {
    record(file, &reals(&[time]));
    record(file, &reals(&[0.0; 22]));
    record(file, &reals(&[1.0, 2.0]));
    record(file, &reals(&[3.0]));
    for values in groups {
        record(file, &reals(values));
    }
}

/// A time, and the variables then with a value for each member.
pub type State<'a> = (f64, Vec<(&'a str, Vec<f64>)>);

/// What an LSDA file is written with.
#[derive(Clone, Copy)]
pub struct Lsda {
    pub little: bool,
    /// 64-bit numbers.
    pub double: bool,
}

impl Lsda {
    fn integer(self, value: u64, width: usize) -> Vec<u8> {
        if self.little {
            value.to_le_bytes()[..width].to_vec()
        } else {
            value.to_be_bytes()[8 - width..].to_vec()
        }
    }

    fn reals(self, values: &[f64]) -> Vec<u8> {
        let bytes = |value: &f64| match (self.double, self.little) {
            (true, true) => value.to_le_bytes().to_vec(),
            (true, false) => value.to_be_bytes().to_vec(),
            (false, true) => (*value as f32).to_le_bytes().to_vec(),
            (false, false) => (*value as f32).to_be_bytes().to_vec(),
        };
        values.iter().flat_map(bytes).collect()
    }

    fn command(self, command: u64, contents: &[u8]) -> Vec<u8> {
        let length = 8 + 1 + contents.len() as u64;
        [self.integer(length, 8), self.integer(command, 1), contents.to_vec()].concat()
    }

    /// A file of one database: its members, and of each state the time and the variables with a value for each member.
    pub fn file(self, database: &str, ids: &[u64], states: &[State<'_>], first: u32) -> Vec<u8> {
        let mut file = vec![8, 8, 8, 1, 1, u8::from(self.little), 0, 0];
        file.extend(self.command(7, &self.integer(0, 8)));
        let real = if self.double { 10 } else { 9 };
        let mut symbols: Vec<(String, Vec<u8>)> = Vec::new();
        let mut write = |file: &mut Vec<u8>, folder: &str, name: &str, kind: u8, count: usize, bytes: Vec<u8>| {
            let at = file.len() as u64;
            let named = [vec![kind, name.len() as u8], name.as_bytes().to_vec(), bytes].concat();
            file.extend(self.command(3, &named));
            let place = [self.integer(at, 8), self.integer(count as u64, 8)].concat();
            let symbol = [name.as_bytes().to_vec(), vec![kind], place].concat();
            symbols.push((folder.to_owned(), symbol));
        };
        let numbers: Vec<u8> = ids.iter().flat_map(|&id| self.integer(id, 4)).collect();
        file.extend(self.command(2, format!("/{database}/metadata").as_bytes()));
        write(
            &mut file,
            &format!("/{database}/metadata"),
            "ids",
            3,
            ids.len(),
            numbers,
        );
        for (k, (time, variables)) in states.iter().enumerate() {
            let folder = format!("/{database}/d{:06}", first + k as u32);
            file.extend(self.command(2, folder.as_bytes()));
            write(&mut file, &folder, "time", real, 1, self.reals(&[*time]));
            for (name, values) in variables {
                write(&mut file, &folder, name, real, values.len(), self.reals(values));
            }
        }
        // The table of symbols in two parts, as a file has that was flushed while it grew.
        let half = symbols.len() / 2;
        let mut link = 17;
        for part in [&symbols[..half], &symbols[half..]] {
            let start = file.len() as u64;
            let mut table = self.command(5, &[]);
            let mut folder = "";
            for (of, symbol) in part {
                if of != folder {
                    // Relative to the last one, where there is one, as the library does.
                    let path = match folder {
                        "" => of.clone(),
                        _ => format!("../{}", of.rsplit('/').next().unwrap()),
                    };
                    table.extend(self.command(2, path.as_bytes()));
                    folder = of;
                }
                table.extend(self.command(4, symbol));
            }
            table.extend(self.command(6, &self.integer(0, 8)));
            let length = self.integer(table.len() as u64, 8);
            table[..8].copy_from_slice(&length);
            file.extend(table);
            let place = self.integer(start, 8);
            file[link..link + 8].copy_from_slice(&place);
            link = file.len() - 8;
        }
        file
    }
}

/// A number as Abaqus writes it by default: so many digits, exponents that are multiples of three, no zeros at the end.
pub fn engineering(value: f64, digits: usize) -> String {
    if value == 0.0 {
        return "0.".to_owned();
    }
    let exact = format!("{value:.*e}", digits - 1);
    let (mantissa, exponent) = exact.split_once('e').unwrap();
    let exponent: i32 = exponent.parse().unwrap();
    let group = exponent.div_euclid(3) * 3;
    let figures: String = mantissa.chars().filter(char::is_ascii_digit).collect();
    let whole = (exponent - group) as usize + 1;
    let sign = if value < 0.0 { "-" } else { "" };
    let fraction = figures[whole..].trim_end_matches('0');
    let power = if group == 0 {
        String::new()
    } else {
        format!("E{group:+03}")
    };
    format!("{sign}{}.{fraction}{power}", &figures[..whole])
}

/// A table of an XY report.
pub fn xy_table(names: &[&str], rows: &[Vec<Option<f64>>], digits: usize) -> String {
    let column = |text: &str| format!("{text:<width$}", width = digits + 13);
    let line = |cells: Vec<String>| format!("{}{}\n", " ".repeat(15), cells.concat());
    let mut text = "\n".to_owned()
        + &line(
            std::iter::once("  X")
                .chain(names.iter().copied())
                .map(column)
                .collect(),
        );
    text.push('\n');
    for row in rows {
        let cell = |value: &Option<f64>| match value {
            Some(value) => column(&engineering(*value, digits)),
            None => column("NoValue"),
        };
        text += &line(row.iter().map(cell).collect());
    }
    text + "\n\n\n"
}
