//! Tables as Parquet files: columns of numbers, of lists of numbers, of flags and of text.
//!
//! Files are not compressed and hold nothing but what is given, so that the same table has the same bytes, and numbers keep their bits.

use std::sync::Arc;

use bytes::Bytes;
use parquet::basic::{ConvertedType, LogicalType, Repetition, Type as Physical};
use parquet::column::reader::{ColumnReader, ColumnReaderImpl};
use parquet::data_type::{BoolType, ByteArray, ByteArrayType, DataType, DoubleType, FloatType, Int32Type};
use parquet::errors::ParquetError;
use parquet::file::properties::{EnabledStatistics, WriterProperties};
use parquet::file::reader::{FileReader, SerializedFileReader};
use parquet::file::writer::{SerializedColumnWriter, SerializedFileWriter};
use parquet::schema::types::{ColumnPath, PrimitiveTypeBuilder, Type};

/// The values of a column, row by row.
#[derive(Debug, Clone, PartialEq)]
pub enum Column {
    /// Whole numbers.
    Int(Vec<i32>),
    /// Numbers of 64 bits.
    Number(Vec<f64>),
    /// Lists of so many numbers of 32 bits, one after another.
    Floats(usize, Vec<f32>),
    /// Lists of so many numbers of 64 bits, one after another.
    Doubles(usize, Vec<f64>),
    /// Flags.
    Flag(Vec<bool>),
    /// Text.
    Text(Vec<String>),
}

/// Named columns of the same number of rows.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Table {
    /// Name and values of each column.
    pub columns: Vec<(String, Column)>,
}

/// Most values of a column, our own choice: those of an hour at 60 frames a second and 256 numbers a frame.
const MOST_VALUES: i64 = 3600 * 60 * 256;

/// A file that is no table of this kind.
#[derive(Debug, thiserror::Error)]
pub enum TableError {
    /// The file is damaged or no Parquet file.
    #[error("cannot be read as Parquet: {0}")]
    Parquet(#[from] ParquetError),
    /// A column of another kind.
    #[error("column {0} is of a kind that demonstrations do not have")]
    Kind(String),
    /// A column whose rows are not those of the table.
    #[error("column {0} does not have as many values as the table has rows")]
    Rows(String),
    /// More values than a table may have.
    #[error("column {0} has more than {MOST_VALUES} values")]
    TooLarge(String),
    /// A column is missing.
    #[error("there is no column {0} of this kind")]
    Missing(&'static str),
}

impl Table {
    /// The rows.
    pub fn rows(&self) -> usize {
        self.columns.first().map_or(0, |(_, column)| column.rows())
    }

    /// A column by its name.
    pub fn column(&self, name: &str) -> Option<&Column> {
        self.columns.iter().find(|(known, _)| known == name).map(|(_, column)| column)
    }

    /// Lists of numbers of 32 bits in a column: their length, and all of them.
    ///
    /// # Errors
    /// There is no such column.
    pub fn floats(&self, name: &'static str) -> Result<(usize, &[f32]), TableError> {
        match self.column(name) {
            Some(Column::Floats(width, values)) => Ok((*width, values)),
            _ => Err(TableError::Missing(name)),
        }
    }

    /// Lists of numbers of 64 bits in a column: their length, and all of them.
    ///
    /// # Errors
    /// There is no such column.
    pub fn doubles(&self, name: &'static str) -> Result<(usize, &[f64]), TableError> {
        match self.column(name) {
            Some(Column::Doubles(width, values)) => Ok((*width, values)),
            _ => Err(TableError::Missing(name)),
        }
    }

    /// The numbers of a column.
    ///
    /// # Errors
    /// There is no such column.
    pub fn numbers(&self, name: &'static str) -> Result<&[f64], TableError> {
        match self.column(name) {
            Some(Column::Number(values)) => Ok(values),
            _ => Err(TableError::Missing(name)),
        }
    }

    /// The texts of a column.
    ///
    /// # Errors
    /// There is no such column.
    pub fn texts(&self, name: &'static str) -> Result<&[String], TableError> {
        match self.column(name) {
            Some(Column::Text(values)) => Ok(values),
            _ => Err(TableError::Missing(name)),
        }
    }

    /// The bytes of the file; `name` is that of its rows in the schema.
    ///
    /// # Errors
    /// Columns of different lengths.
    pub fn to_parquet(&self, name: &str) -> Result<Vec<u8>, TableError> {
        let fields = self.columns.iter().map(|(name, column)| Ok(Arc::new(column.field(name)?)));
        let fields: Vec<Arc<Type>> = fields.collect::<Result<_, ParquetError>>()?;
        let schema = Arc::new(Type::group_type_builder(name).with_fields(fields).build()?);
        let mut properties = WriterProperties::builder()
            .set_dictionary_enabled(false)
            .set_statistics_enabled(EnabledStatistics::None);
        for (name, column) in &self.columns {
            if column.rows() != self.rows() {
                return Err(TableError::Rows(name.clone()));
            }
            if let Column::Text(_) = column {
                properties = properties.set_column_dictionary_enabled(ColumnPath::from(name.as_str()), true);
            }
        }
        let mut writer = SerializedFileWriter::new(Vec::new(), schema, Arc::new(properties.build()))?;
        let mut group = writer.next_row_group()?;
        for (_, column) in &self.columns {
            if let Some(mut into) = group.next_column()? {
                column.write(&mut into)?;
                into.close()?;
            }
        }
        group.close()?;
        Ok(writer.into_inner()?)
    }

    /// Reads the bytes of a file.
    ///
    /// # Errors
    /// The file is damaged or no Parquet file, or has columns that [`Column`] does not have.
    pub fn from_parquet(bytes: Vec<u8>) -> Result<Self, TableError> {
        let file = SerializedFileReader::new(Bytes::from(bytes))?;
        let schema = file.metadata().file_metadata().schema_descr_ptr();
        let mut table = Self::default();
        for i in 0..schema.num_columns() {
            let name = schema.column(i).path().parts().first().cloned().unwrap_or_default();
            let listed = schema.column(i).max_rep_level() > 0;
            let mut whole: Option<Column> = None;
            for group in 0..file.num_row_groups() {
                let group = file.get_row_group(group)?;
                if group.metadata().column(i).num_values() > MOST_VALUES {
                    return Err(TableError::TooLarge(name));
                }
                let rows = group.metadata().num_rows().try_into().unwrap_or(0);
                let read = Column::read(&name, group.get_column_reader(i)?, listed, rows)?;
                match &mut whole {
                    None => whole = Some(read),
                    Some(_) => return Err(TableError::Kind(name)),
                }
            }
            table.columns.push((name, whole.unwrap_or(Column::Int(Vec::new()))));
        }
        let rows = table.rows();
        match table.columns.iter().find(|(_, column)| column.rows() != rows) {
            Some((name, _)) => Err(TableError::Rows(name.clone())),
            None => Ok(table),
        }
    }

    /// The first difference from another table, for people: column and row; `None` if every bit is the same.
    pub fn difference(&self, other: &Self) -> Option<String> {
        if self.rows() != other.rows() {
            return Some(format!("{} rows, not {}", self.rows(), other.rows()));
        }
        let names = |table: &Self| table.columns.iter().map(|(name, _)| name.clone()).collect::<Vec<_>>();
        if names(self) != names(other) {
            return Some("other columns".to_owned());
        }
        let mut pairs = self.columns.iter().zip(&other.columns);
        pairs.find_map(|((name, a), (_, b))| {
            a.first_difference(b).map(|row| format!("column {name} differs first in row {row}"))
        })
    }
}

impl Column {
    /// The rows.
    pub fn rows(&self) -> usize {
        match self {
            Self::Int(values) => values.len(),
            Self::Number(values) => values.len(),
            Self::Floats(width, values) => values.len() / (*width).max(1),
            Self::Doubles(width, values) => values.len() / (*width).max(1),
            Self::Flag(values) => values.len(),
            Self::Text(values) => values.len(),
        }
    }

    /// The first row that has other bits.
    fn first_difference(&self, other: &Self) -> Option<usize> {
        fn first<T>(a: &[T], b: &[T], width: usize, same: impl Fn(&T, &T) -> bool) -> Option<usize> {
            if a.len() != b.len() {
                return Some(0);
            }
            a.iter().zip(b).position(|(a, b)| !same(a, b)).map(|i| i / width.max(1))
        }
        match (self, other) {
            (Self::Int(a), Self::Int(b)) => first(a, b, 1, i32::eq),
            (Self::Number(a), Self::Number(b)) => first(a, b, 1, |a, b| a.to_bits() == b.to_bits()),
            (Self::Floats(n, a), Self::Floats(m, b)) if n == m => {
                first(a, b, *n, |a, b| a.to_bits() == b.to_bits())
            }
            (Self::Doubles(n, a), Self::Doubles(m, b)) if n == m => {
                first(a, b, *n, |a, b| a.to_bits() == b.to_bits())
            }
            (Self::Flag(a), Self::Flag(b)) => first(a, b, 1, bool::eq),
            (Self::Text(a), Self::Text(b)) => first(a, b, 1, String::eq),
            _ => Some(0),
        }
    }

    /// The column in the schema; every value is there, and so is every element of a list.
    fn field(&self, name: &str) -> Result<Type, ParquetError> {
        fn plain(name: &str, physical: Physical) -> PrimitiveTypeBuilder<'_> {
            Type::primitive_type_builder(name, physical).with_repetition(Repetition::REQUIRED)
        }
        let list = |physical| {
            let repeated = Type::group_type_builder("list")
                .with_repetition(Repetition::REPEATED)
                .with_fields(vec![Arc::new(plain("element", physical).build()?)])
                .build()?;
            Type::group_type_builder(name)
                .with_repetition(Repetition::REQUIRED)
                .with_logical_type(Some(LogicalType::List))
                .with_converted_type(ConvertedType::LIST)
                .with_fields(vec![Arc::new(repeated)])
                .build()
        };
        match self {
            Self::Int(_) => plain(name, Physical::INT32).build(),
            Self::Number(_) => plain(name, Physical::DOUBLE).build(),
            Self::Floats(..) => list(Physical::FLOAT),
            Self::Doubles(..) => list(Physical::DOUBLE),
            Self::Flag(_) => plain(name, Physical::BOOLEAN).build(),
            Self::Text(_) => plain(name, Physical::BYTE_ARRAY)
                .with_logical_type(Some(LogicalType::String))
                .with_converted_type(ConvertedType::UTF8)
                .build(),
        }
    }

    fn write(&self, into: &mut SerializedColumnWriter<'_>) -> Result<(), ParquetError> {
        // A list begins at repetition 0, and its elements are defined at level 1.
        let levels = |width: usize, count: usize| -> (Vec<i16>, Vec<i16>) {
            (vec![1; count], (0..count).map(|i| i16::from(i % width.max(1) != 0)).collect())
        };
        match self {
            Self::Int(values) => into.typed::<Int32Type>().write_batch(values, None, None),
            Self::Number(values) => into.typed::<DoubleType>().write_batch(values, None, None),
            Self::Floats(width, values) => {
                let (defined, repeated) = levels(*width, values.len());
                into.typed::<FloatType>().write_batch(values, Some(&defined), Some(&repeated))
            }
            Self::Doubles(width, values) => {
                let (defined, repeated) = levels(*width, values.len());
                into.typed::<DoubleType>().write_batch(values, Some(&defined), Some(&repeated))
            }
            Self::Flag(values) => into.typed::<BoolType>().write_batch(values, None, None),
            Self::Text(values) => {
                let values: Vec<ByteArray> = values.iter().map(|text| text.as_str().into()).collect();
                into.typed::<ByteArrayType>().write_batch(&values, None, None)
            }
        }
        .map(drop)
    }

    fn read(name: &str, reader: ColumnReader, listed: bool, rows: usize) -> Result<Self, TableError> {
        let kind = || TableError::Kind(name.to_owned());
        Ok(match (reader, listed) {
            (ColumnReader::Int32ColumnReader(reader), false) => Self::Int(values(reader, rows)?),
            (ColumnReader::DoubleColumnReader(reader), false) => Self::Number(values(reader, rows)?),
            (ColumnReader::BoolColumnReader(reader), false) => Self::Flag(values(reader, rows)?),
            (ColumnReader::FloatColumnReader(reader), true) => {
                let (width, values) = lists(reader, rows)?.ok_or_else(kind)?;
                Self::Floats(width, values)
            }
            (ColumnReader::DoubleColumnReader(reader), true) => {
                let (width, values) = lists(reader, rows)?.ok_or_else(kind)?;
                Self::Doubles(width, values)
            }
            (ColumnReader::ByteArrayColumnReader(reader), false) => {
                let bytes: Vec<ByteArray> = values(reader, rows)?;
                let text = |bytes: &ByteArray| bytes.as_utf8().map(str::to_owned);
                Self::Text(bytes.iter().map(text).collect::<Result<_, _>>()?)
            }
            _ => return Err(kind()),
        })
    }
}

fn values<T: DataType>(mut reader: ColumnReaderImpl<T>, rows: usize) -> Result<Vec<T::T>, ParquetError> {
    let (mut values, mut defined) = (Vec::new(), Vec::new());
    reader.read_records(rows, Some(&mut defined), None, &mut values)?;
    Ok(values)
}

/// Length of lists, and their values one after another.
type Lists<T> = (usize, Vec<T>);

/// Lists of one length; `None` if they have several.
fn lists<T: DataType>(
    mut reader: ColumnReaderImpl<T>,
    rows: usize,
) -> Result<Option<Lists<T::T>>, ParquetError> {
    let (mut values, mut defined, mut repeated) = (Vec::new(), Vec::new(), Vec::new());
    reader.read_records(rows, Some(&mut defined), Some(&mut repeated), &mut values)?;
    let width = values.len() / rows.max(1);
    let even = repeated.iter().enumerate().all(|(i, level)| (*level == 0) == (i % width.max(1) == 0));
    Ok((even && values.len() == width * rows && defined.iter().all(|d| *d == 1)).then_some((width, values)))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn table() -> Table {
        let text = |texts: &[&str]| Column::Text(texts.iter().map(|t| (*t).to_owned()).collect());
        let columns = [
            ("frame", Column::Int(vec![0, 6, -7])),
            ("reward", Column::Number(vec![0.1, -0.0, f64::NAN])),
            ("action", Column::Floats(2, vec![0.1, -0.0, f32::INFINITY, 1e-40, 5.0, f32::NAN])),
            ("arm_q", Column::Doubles(1, vec![1.0 / 3.0, f64::NEG_INFINITY, 1e-310])),
            ("terminated", Column::Flag(vec![false, true, false])),
            ("depth", text(&["", "depth/1.png", "depth/1.png"])),
        ];
        Table { columns: columns.map(|(name, column)| (name.to_owned(), column)).to_vec() }
    }

    #[test]
    fn a_table_comes_back_with_every_bit() {
        let bytes = table().to_parquet("steps").unwrap();
        assert_eq!(bytes, table().to_parquet("steps").unwrap());
        let read = Table::from_parquet(bytes.clone()).unwrap();
        assert_eq!(read.difference(&table()), None);
        assert_eq!((read.rows(), read.floats("action").unwrap().0), (3, 2));
        assert_eq!(read.floats("arm_q").unwrap_err().to_string(), "there is no column arm_q of this kind");
        assert!(Table::from_parquet(bytes[..bytes.len() / 2].to_vec()).is_err());
        assert!(Table::from_parquet(Vec::new()).is_err());
    }

    #[test]
    fn a_difference_is_named_by_column_and_row() {
        let mut other = table();
        let Column::Floats(_, values) = &mut other.columns[2].1 else { panic!() };
        values[5] = -values[5];
        let said = table().difference(&other).unwrap();
        assert_eq!(said, "column action differs first in row 2");
        other.columns[4].1 = Column::Flag(vec![true]);
        assert!(matches!(other.to_parquet("steps"), Err(TableError::Rows(name)) if name == "terminated"));
        other.columns.truncate(2);
        assert_eq!(table().difference(&other).unwrap(), "other columns");
    }
}
