//! Apache Parquet: a column for each column, codes as words, the metadata as JSON under a key of the file.

use super::ExportError;
use super::metadata::{MARK, Origin, metadata};
use super::table::{Column, Kind, Table};
use parquet::basic::{LogicalType, Repetition, Type as Physical};
use parquet::data_type::{ByteArray, ByteArrayType, DoubleType, Int64Type};
use parquet::errors::ParquetError;
use parquet::file::metadata::KeyValue;
use parquet::file::properties::WriterProperties;
use parquet::file::writer::SerializedFileWriter;
use parquet::schema::types::Type;
use std::fs::File;
use std::io;
use std::path::Path;
use std::sync::Arc;

/// Rows of a group: all columns of it are written one after the other.
const GROUP: usize = 1 << 20;

fn schema(table: &Table) -> Result<Type, ParquetError> {
    let field = |column: &Column| {
        let (physical, logical) = match column.kind {
            Kind::Number => (Physical::DOUBLE, None),
            Kind::Whole => (Physical::INT64, None),
            Kind::Code => (Physical::BYTE_ARRAY, Some(LogicalType::String)),
        };
        Type::primitive_type_builder(&column.name, physical)
            .with_repetition(Repetition::REQUIRED)
            .with_logical_type(logical)
            .build()
            .map(Arc::new)
    };
    let fields = table.columns.iter().map(field).collect::<Result<Vec<_>, _>>()?;
    Type::group_type_builder(&table.name).with_fields(fields).build()
}

/// Writes a table.
///
/// # Errors
/// The table cannot be read, or the file not be written.
pub(super) fn write(table: &Table, origin: &Origin, file: &File, path: &Path) -> Result<(), ExportError> {
    let failed = |error: ParquetError| ExportError::io(path, "writing", io::Error::other(error));
    let keys = vec![KeyValue::new(MARK.to_owned(), metadata(table, origin))];
    let mut properties = WriterProperties::builder()
        .set_key_value_metadata(Some(keys))
        .set_created_by(origin.source.clone())
        .set_dictionary_enabled(false);
    for column in table.columns.iter().filter(|column| column.kind == Kind::Code) {
        properties = properties.set_column_dictionary_enabled(column.name.as_str().into(), true);
    }
    let schema = Arc::new(schema(table).map_err(failed)?);
    let mut writer = SerializedFileWriter::new(file, schema, Arc::new(properties.build())).map_err(failed)?;
    for first in (0..table.rows).step_by(GROUP) {
        let end = table.rows.min(first + GROUP);
        let mut group = writer.next_row_group().map_err(failed)?;
        for (k, column) in table.columns.iter().enumerate() {
            let Some(mut sink) = group.next_column().map_err(failed)? else {
                continue;
            };
            for rows in table.blocks().filter(|rows| (first..end).contains(&rows.start)) {
                let values = table.read(k, rows)?;
                let written = match column.kind {
                    Kind::Number => sink.typed::<DoubleType>().write_batch(&values, None, None),
                    Kind::Whole => {
                        let whole: Vec<i64> = values.iter().map(|&value| value as i64).collect();
                        sink.typed::<Int64Type>().write_batch(&whole, None, None)
                    }
                    Kind::Code => {
                        let words: Vec<ByteArray> = values
                            .iter()
                            .map(|&value| ByteArray::from(column.word(value).into_bytes()))
                            .collect();
                        sink.typed::<ByteArrayType>().write_batch(&words, None, None)
                    }
                };
                written.map_err(failed)?;
            }
            sink.close().map_err(failed)?;
        }
        group.close().map_err(failed)?;
    }
    writer.close().map_err(failed)?;
    Ok(())
}
