//! Arrays of NumPy: every form of header that NumPy writes is read, and invalid headers are refused.

use crate::common::compare::paper;
use proptest::prelude::*;
use std::io::Write;
use std::path::Path;
use stickslip::compare::{Mapping, Reference};

/// Element type: its code, its size in bytes, and the bits of a small whole number.
type ElementType = (&'static str, usize, fn(u8) -> u64);

/// Element types with the bits of small whole numbers, the lowest byte first.
const TYPES: [ElementType; 12] = [
    ("f8", 8, |n| f64::from(n).to_bits()),
    ("f4", 4, |n| u64::from(f32::from(n).to_bits())),
    ("f2", 2, |n| [0, 0x3c00, 0x4000, 0x4200][usize::from(n)]),
    ("i8", 8, u64::from as fn(u8) -> u64),
    ("i4", 4, |n| u64::from(n)),
    ("i2", 2, |n| u64::from(n)),
    ("i1", 1, |n| u64::from(n)),
    ("u8", 8, |n| u64::from(n)),
    ("u4", 4, |n| u64::from(n)),
    ("u2", 2, |n| u64::from(n)),
    ("u1", 1, |n| u64::from(n)),
    ("b1", 1, |n| u64::from(n.min(1))),
];

fn bytes(number: u64, size: usize, big: bool) -> Vec<u8> {
    let mut bytes = number.to_le_bytes()[..size].to_vec();
    if big {
        bytes.reverse();
    }
    bytes
}

/// An array in one of the versions of the format.
fn npy(version: u8, header: &[u8], values: &[u8]) -> Vec<u8> {
    let length = (header.len() as u32).to_le_bytes();
    let length = &length[..if version == 1 { 2 } else { 4 }];
    [b"\x93NUMPY".as_slice(), &[version, 0], length, header, values].concat()
}

fn plain(values: &[u8]) -> Vec<u8> {
    let header = format!(
        "{{'descr': '<f8', 'fortran_order': False, 'shape': ({},), }}\n",
        values.len()
    );
    let values: Vec<u8> = values.iter().flat_map(|&n| f64::from(n).to_le_bytes()).collect();
    npy(1, header.as_bytes(), &values)
}

/// Errors of the channels for a file with this column, or the refusal.
fn compared(path: &Path, column: &str) -> Result<String, String> {
    thread_local! {
        static REFERENCE: Reference = Reference::open(paper()).unwrap();
    }
    REFERENCE.with(|reference| {
        let mut mapping = Mapping {
            quick: true,
            ..reference.mapping()
        };
        mapping.add_option(&format!("phi1={column}")).unwrap();
        let compared = reference.compare(path, &mapping);
        compared
            .map(|compared| format!("{:?}", compared.channels))
            .map_err(|error| error.to_string())
    })
}

/// Like [`compared`], for an archive with this array and plain ones.
fn compared_with(array: &[u8], column: &str) -> Result<String, String> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("candidate.npz");
    let mut archive = zip::ZipWriter::new(std::fs::File::create(&path).unwrap());
    let options = zip::write::SimpleFileOptions::default().compression_method(zip::CompressionMethod::Stored);
    for (name, array) in [
        ("time", &plain(&[1, 2, 3, 4])[..]),
        ("relative_velocity", &plain(&[1; 4])),
        ("other", array),
    ] {
        archive.start_file(format!("{name}.npy"), options).unwrap();
        archive.write_all(array).unwrap();
    }
    archive.finish().unwrap();
    compared(&path, column)
}

/// tests/common/numpy/make.py writes the files.
#[test]
fn property_what_numpy_writes_is_read() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/common/numpy");
    let expected = compared_with(&plain(&[1, 0, 1, 1]), "other").unwrap();
    assert!(expected.contains("phi1"), "{expected}");
    for name in ["types.npz", "packed.npz"] {
        let path = folder.join(name);
        let kinds = TYPES.iter().take(11).map(|&(kind, ..)| kind);
        let numbers = kinds.flat_map(|kind| [format!("little_{kind}"), format!("big_{kind}")]);
        let others = [
            "little_f8_2",
            "little_f8_3",
            "truth",
            "column",
            "wide[:,1]",
            "fortran[:,1]",
            "fortran[1]",
        ];
        for column in numbers.chain(others.map(str::to_owned)) {
            assert_eq!(compared(&path, &column).as_ref(), Ok(&expected), "{name}: {column}");
        }
        for (column, what) in [
            ("complex", "complex numbers (<c16)"),
            ("long", "(<f16)"),
            ("object", "Python objects (|O)"),
            ("dates", "dates or times of NumPy (<M8[ns])"),
            ("raw", "(|V3)"),
            ("texts", "texts"),
            ("bytes", "texts"),
            ("empty", "[0, 5]"),
            ("single", "single number"),
            ("records", "records"),
            ("greek", "records"),
            ("padded", "records"),
        ] {
            let refusal = compared(&path, column).unwrap_err();
            assert!(refusal.contains(what) && refusal.contains(column), "{refusal}");
        }
    }
}

/// The error names the problem and the array.
#[test]
fn property_wrong_headers_are_refused_by_what_is_wrong() {
    let whole = "{'descr': '<f8', 'fortran_order': False, 'shape': (4,), }\n";
    let values = [0; 32];
    let refused = |array: &[u8], what: &str| {
        let refusal = compared_with(array, "other").unwrap_err();
        assert!(refusal.contains("other") && refusal.contains(what), "{what}: {refusal}");
    };
    let header = |text: &str| npy(1, text.as_bytes(), &values);
    assert!(compared_with(&header(whole), "other").is_ok());
    for (from, to, what) in [
        ("'descr': '<f8', ", "", "without descr"),
        ("'fortran_order': False, ", "", "without fortran_order"),
        ("'shape': (4,), ", "", "without shape"),
        ("'shape': (4,)", "'shape': (4,), 'shape': (4,)", "shape twice"),
        ("(4,)", "(5,)", "longer than its member"),
        ("(4,)", "(-4,)", "\"-4,), }"),
        ("(4,)", "4", "\"4, }"),
        ("(4,)", "(4.0,)", "\".0,), }"),
        ("(4,)", "(18446744073709551616,)", "\"18446744073709551616,"),
        ("(4,)", "(4294967296, 4294967296)", "longer than its member"),
        ("(4,)", "(0, 4294967296, 4294967296)", "longer than its member"),
        ("(4,)", "(0, 9223372036854775807)", "longer than its member"),
        ("False", "0", "\"0, 'shape'"),
        ("'<f8'", "8", "\"8, 'fortran_order'"),
        ("'<f8'", "'<f3'", "(<f3)"),
        ("'<f8'", "'<f+8'", "(<f+8)"),
        ("'<f8'", "'|f8'", "(|f8)"),
        ("'<f8'", "'f8'", "(f8)"),
        ("'<f8'", "''", "()"),
        ("'<f8'", "'<U4611686018427387904'", "(<U4611686018427387904)"),
        ("'<f8'", "'<U1000'", "longer than its member"),
        ("'<f8'", "[('a', '<f8'", "\": False, 'shape'"),
        ("'<f8'", "[('a', '<f8')]", "records"),
        (", }\n", "", "breaks off"),
        (", }\n", ", } 'x'", "\"'x'\""),
        ("'descr'", "'desc'", "\"'desc': "),
        ("'<f8'", "'<f8", "'shape'"),
        ("\n", "\0", "on"),
    ] {
        assert!(whole.contains(from), "{from}");
        refused(&header(&whole.replace(from, to)), what);
    }
    refused(&header(&format!("{}{whole}", "[".repeat(60_000))), "[[[");
    let deep = format!("{}'<f8'{}", "[(".repeat(20_000), ")]".repeat(10_000));
    refused(&header(&whole.replace("'<f8'", &deep)), "cannot be read");
    refused(&npy(4, whole.as_bytes(), &values), "version 4.0");
    refused(&npy(2, whole.as_bytes(), &[])[..40], "ends within its header");
    refused(b"\x93NUMPY\x01", "ends within its header");
    refused(b"", "no array of NumPy");
    let mut endless = npy(3, whole.as_bytes(), &values);
    endless[8..12].fill(0xff);
    refused(&endless, "4294967295 bytes, more than 1 MB");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    /// The same values in any type, order and shape, under any header that Python would read.
    #[test]
    fn property_every_form_of_a_header_is_read(
        values in prop::array::uniform4(0u8..4),
        (kind, big, version) in (0..TYPES.len(), any::<bool>(), 1u8..4),
        (columns, fortran) in (0usize..4, any::<bool>()),
        keys in Just(vec![0, 1, 2]).prop_shuffle(),
        quote in prop::sample::select(vec!["'", "\""]),
        blanks in prop::collection::vec(prop::sample::select(vec!["", " ", "  ", "\t", "\n"]), 16),
        (comma, padding) in (any::<bool>(), 0usize..200),
        chosen in any::<prop::sample::Index>(),
    ) {
        let (kind, size, number) = TYPES[kind];
        let values = if kind == "b1" { values.map(|n| n.min(1)) } else { values };
        // Without columns, the array has one dimension.
        let wide = columns.max(1);
        let chosen = chosen.index(wide);
        let place = |row: usize, column: usize| if fortran { column * 4 + row } else { row * wide + column };
        let mut elements = vec![3; 4 * wide];
        (0..4).for_each(|row| elements[place(row, chosen)] = values[row]);
        let data: Vec<u8> = elements.iter().flat_map(|&n| bytes(number(n), size, big)).collect();

        let mut blanks = blanks.into_iter().cycle();
        let mut blank = || blanks.next().unwrap();
        let order = if size == 1 && !big { "|" } else if big { ">" } else { "<" };
        let shape = match columns {
            0 => format!("({}4{},{})", blank(), blank(), blank()),
            _ => format!("(4,{}{columns}{})", blank(), blank()),
        };
        let fields = [
            ("descr", format!("{quote}{order}{kind}{quote}")),
            ("fortran_order", if fortran { "True" } else { "False" }.to_owned()),
            ("shape", shape),
        ];
        let fields: Vec<String> = keys
            .iter()
            .map(|&k| format!("{}{quote}{}{quote}{}:{}{}{}", blank(), fields[k].0, blank(), blank(), fields[k].1, blank()))
            .collect();
        let comma = if comma { "," } else { "" };
        let header = format!("{}{{{}{comma}{}}}{}\n", blank(), fields.join(","), blank(), " ".repeat(padding));
        let array = npy(version, header.as_bytes(), &data);
        let column = if columns < 2 { "other".to_owned() } else { format!("other[:,{chosen}]") };
        prop_assert_eq!(compared_with(&array, &column), compared_with(&plain(&values), "other"), "{}", header);
    }

    /// Shapes of any size are refused or read, whichever column is requested.
    #[test]
    fn property_no_shape_is_too_large_to_be_refused(
        shape in prop::collection::vec(prop_oneof![
            0u64..3, (0u32..64).prop_map(|k| 1 << k), (1u32..65).prop_map(|k| u64::MAX >> (64 - k)),
        ], 0..4),
        kind in prop::sample::select(vec!["<f8", "|u1", "<U0", "|S0", "<U3", ">f2"]),
        fortran in any::<bool>(),
        index in prop_oneof![0usize..3, (0u32..64).prop_map(|k| 1 << k)],
        slice in prop::sample::select(vec!["", "[N]", "[N,:]", "[:,N]"]),
    ) {
        let fortran = if fortran { "True" } else { "False" };
        let axes: String = shape.iter().map(|n| format!("{n},")).collect();
        let header = format!("{{'descr': '{kind}', 'fortran_order': {fortran}, 'shape': ({axes})}}\n");
        let outcome = compared_with(&npy(1, header.as_bytes(), &[0; 64]), &format!("other{}", slice.replace('N', &index.to_string())));
        let refusal = outcome.err().unwrap_or_else(|| "candidate.npz".to_owned());
        prop_assert!(refusal.contains("candidate.npz"), "{}", refusal);
    }
}
