//! ROS 2 bags of the storage sqlite3: one database a file, opened without being changed.
//!
//! A database brings queries of its own along: a view may take the place of a table, a column be calculated when it is read, and
//! either may have no end. Only plain tables are read; what they take is drawn from the budget of the bag.

use super::failed;
use crate::error::ImportError;
use crate::ros::{Collector, Incoming};
use rusqlite::config::DbConfig;
use rusqlite::limits::Limit;
use rusqlite::{Connection, ErrorCode, OpenFlags};
use shared_mem::budget::{self, Budget};
use shared_mem::input::Packing;
use shared_mem::printable;
use std::collections::HashMap;
use std::io::Read as _;
use std::path::{Path, PathBuf};
use std::rc::Rc;

/// Instructions of the database's machine between two looks at the budget: some microseconds.
const INSTRUCTIONS: usize = 1000;
/// Instructions are steps; whatever else a row takes is these.
const STEPS_OF_A_ROW: usize = 16;
/// Bytes of a message that are unpacked in a step.
const BYTES_OF_A_STEP: usize = 8;
/// How a database begins.
pub(super) const MAGIC: &[u8] = b"SQLite format 3\0";
/// A value longer than the file is none that it holds; what the database says about itself may be so long in any [bytes].
const SHORTEST_LIMIT: u64 = 1 << 20;

/// A topic by its number in the database.
struct Topic {
    name: String,
    type_name: String,
    definition: Rc<[u8]>,
}

/// A bag that is open.
struct Bag<'a> {
    path: &'a Path,
    connection: Connection,
    budget: &'a Budget,
}

/// Whether a file begins as a database does.
pub(super) fn is_database(path: &Path) -> Result<bool, ImportError> {
    let (mut start, mut file) = (Vec::new(), shared_mem::input::open(path)?);
    file.by_ref().take(MAGIC.len() as u64).read_to_end(&mut start).map_err(failed(path))?;
    Ok(start == MAGIC)
}

/// Takes the messages of a bag over, and returns what is missing of it.
pub(super) fn read(path: &Path, collector: &mut Collector<'_>) -> Result<Option<String>, ImportError> {
    shared_mem::input::open(path)?;
    let budget = collector.budget().clone();
    let copy = Copy::beside_its_journal(path)?;
    let place = copy.as_ref().map_or(path, |copy| copy.database.as_path());
    let bag = Bag::open((path, place), &budget)?;
    let damage = bag.damage()?;
    if damage.is_some() {
        bag.read_what_is_left()?;
    }
    for table in ["topics", "messages"] {
        if !bag.has_table(table)? {
            let what =
                format!("is no ROS 2 bag (it has no `{table}`); give a database that `ros2 bag record` has written");
            return Err(ImportError::log(path, what));
        }
    }
    let topics = bag.topics()?;
    let mut count = Count::default();
    match damage {
        None => bag.in_order(&topics, collector, &mut count)?,
        Some(_) => bag.by_number(&topics, collector, &mut count)?,
    }
    let odd = (count.odd > 0).then(|| format!("{} rows are no message of a topic that it lists", count.odd));
    let damage = damage
        .map(|damage| format!("the file is damaged: {damage}; the {} messages that are whole are read", count.read));
    Ok(damage.or(odd))
}

/// Messages of a bag.
#[derive(Debug, Default)]
struct Count {
    read: u64,
    /// Rows that are no message of a topic that it lists.
    odd: u64,
    /// The number of the last.
    last: Option<i64>,
}

/// A copy of a database with the journal beside it, in which a recorder that was killed has left what it was changing: SQLite takes
/// the changes back before it reads, and what a robot has recorded stays as it is.
struct Copy {
    database: PathBuf,
    _folder: tempfile::TempDir,
}

impl Copy {
    /// `None` where there is no such journal.
    fn beside_its_journal(path: &Path) -> Result<Option<Self>, ImportError> {
        let journal = |path: &Path| path.with_extension("db3-journal");
        if std::fs::metadata(journal(path)).map_or(0, |about| about.len()) == 0 {
            return Ok(None);
        }
        let folder = tempfile::Builder::new().prefix("twinalign-").tempdir().map_err(failed(path))?;
        let database = folder.path().join("bag.db3");
        for (from, to) in [(path.to_owned(), "bag.db3"), (journal(path), "bag.db3-journal")] {
            let copy = tempfile::Builder::new().prefix(to).rand_bytes(0).tempfile_in(&folder).map_err(failed(path))?;
            let (mut copy, _) = copy.keep().map_err(|e| failed(path)(e.error))?;
            std::io::copy(&mut shared_mem::input::open(&from)?, &mut copy).map_err(failed(path))?;
        }
        Ok(Some(Self { database, _folder: folder }))
    }
}

/// Where a recorder keeps what it has not yet put into the database.
pub(super) fn journal(path: &Path) -> PathBuf {
    path.with_extension("db3-wal")
}

impl<'a> Bag<'a> {
    /// Opens a database that it does not trust: the bag at `path`, or a copy of it.
    fn open((path, place): (&'a Path, &Path), budget: &'a Budget) -> Result<Self, ImportError> {
        // Where a recorder left a journal the database has to take it in, elsewhere nothing is locked or written.
        let (mode, access) = if place != path {
            ("mode=rw", OpenFlags::SQLITE_OPEN_READ_WRITE)
        } else if journal(path).exists() {
            ("mode=ro", OpenFlags::SQLITE_OPEN_READ_ONLY)
        } else {
            ("immutable=1", OpenFlags::SQLITE_OPEN_READ_ONLY)
        };
        let absolute = std::path::absolute(place).unwrap_or_else(|_| place.to_owned());
        let escaped: String = absolute.to_string_lossy().replace('%', "%25").replace('?', "%3f").replace('#', "%23");
        let flags = access | OpenFlags::SQLITE_OPEN_URI | OpenFlags::SQLITE_OPEN_NO_MUTEX;
        let failed = |error| broken(path, budget, &error);
        let mut connection = Connection::open_with_flags(format!("file:{escaped}?{mode}"), flags).map_err(failed)?;
        let size = |path: &Path| std::fs::metadata(path).map_or(0, |about| about.len());
        let longest = (size(path) + size(&journal(path))).max(SHORTEST_LIMIT);
        // SQLite's own limit is below 2^31.
        let longest = i32::try_from(longest).unwrap_or(i32::MAX);
        connection.set_limit(Limit::SQLITE_LIMIT_LENGTH, longest).map_err(failed)?;
        for (setting, on) in [
            (DbConfig::SQLITE_DBCONFIG_DEFENSIVE, true),
            (DbConfig::SQLITE_DBCONFIG_ENABLE_VIEW, false),
            (DbConfig::SQLITE_DBCONFIG_TRUSTED_SCHEMA, false),
        ] {
            connection.set_db_config(setting, on).map_err(failed)?;
        }
        let drawn = budget.clone();
        let look = move || drawn.step(INSTRUCTIONS).is_err();
        connection.progress_handler(INSTRUCTIONS as i32, Some(look)).map_err(failed)?;
        Ok(Self { path, connection, budget })
    }

    fn broken(&self, error: &rusqlite::Error) -> ImportError {
        broken(self.path, self.budget, error)
    }

    /// What is wrong with its pages; `None` where they fit each other. What its tables demand of their rows is not evaluated.
    fn damage(&self) -> Result<Option<String>, ImportError> {
        let verdict = || -> rusqlite::Result<String> {
            self.connection.pragma_update(None, "ignore_check_constraints", true)?;
            self.connection.query_row("PRAGMA quick_check(1)", [], |row| row.get(0))
        };
        match verdict() {
            Ok(verdict) if verdict == "ok" => Ok(None),
            Ok(verdict) => {
                Ok(Some(printable::one_line(verdict.trim_start_matches("*** in database main ***")).trim().to_owned()))
            }
            Err(error) if error.sqlite_error_code() == Some(ErrorCode::DatabaseCorrupt) => Ok(Some(self.cut())),
            Err(error) => Err(self.broken(&error)),
        }
    }

    /// What a database says that cannot be looked at: how many of its pages are there.
    fn cut(&self) -> String {
        let header = || -> Option<[u64; 2]> {
            let mut bytes = [0; 32];
            let mut file = shared_mem::input::open(self.path).ok()?;
            file.read_exact(&mut bytes).ok()?;
            // The largest page has no place in two bytes.
            let page = match u16::from_be_bytes([bytes[16], bytes[17]]) {
                1 => 1 << 16,
                size => u64::from(size),
            };
            let pages = u64::from(u32::from_be_bytes([bytes[28], bytes[29], bytes[30], bytes[31]]));
            Some([file.metadata().ok()?.len().checked_div(page)?, pages])
        };
        match header() {
            Some([there, pages]) if there < pages => format!("{there} of its {pages} pages are there"),
            _ => "its pages do not fit each other".into(),
        }
    }

    /// Has SQLite read a database whose end is cut, as far as it goes. Nothing can be written through this connection.
    fn read_what_is_left(&self) -> Result<(), ImportError> {
        let failed = |error| self.broken(&error);
        self.connection.set_db_config(DbConfig::SQLITE_DBCONFIG_DEFENSIVE, false).map_err(failed)?;
        self.connection.pragma_update(None, "writable_schema", true).map_err(failed)
    }

    /// All messages, by their stamps.
    fn in_order(
        &self,
        topics: &HashMap<i64, Topic>,
        collector: &mut Collector<'_>,
        count: &mut Count,
    ) -> Result<(), ImportError> {
        let sql = "SELECT id, topic_id, timestamp, data FROM messages ORDER BY timestamp, id";
        let mut statement = self.connection.prepare(sql).map_err(|error| self.broken(&error))?;
        let mut rows = statement.query([]).map_err(|error| self.broken(&error))?;
        while let Some(row) = rows.next().map_err(|error| self.broken(&error))? {
            self.message(row, topics, (collector, count))?;
        }
        Ok(())
    }

    /// The messages of a damaged database, by their numbers: where one cannot be read, from one behind it on, and farther with each
    /// that cannot be read either.
    fn by_number(
        &self,
        topics: &HashMap<i64, Topic>,
        collector: &mut Collector<'_>,
        count: &mut Count,
    ) -> Result<(), ImportError> {
        /// Farther than any bag reaches.
        const FARTHEST: i64 = 1 << 40;
        let sql = "SELECT id, topic_id, timestamp, data FROM messages NOT INDEXED WHERE id > ?1 ORDER BY id";
        let mut statement = self.connection.prepare(sql).map_err(|error| self.broken(&error))?;
        let (mut after, mut step) = (0_i64, 1_i64);
        while step < FARTHEST {
            let mut rows = statement.query([after]).map_err(|error| self.broken(&error))?;
            let error = loop {
                match rows.next() {
                    Ok(Some(row)) => self.message(row, topics, (collector, count))?,
                    Ok(None) => return Ok(()),
                    Err(error) => break error,
                }
            };
            if error.sqlite_error_code() != Some(ErrorCode::DatabaseCorrupt) {
                return Err(self.broken(&error));
            }
            self.budget.step(STEPS_OF_A_ROW).map_err(ImportError::budget(self.path))?;
            step = if count.last.is_some_and(|last| last > after) { 1 } else { step.saturating_mul(2) };
            after = count.last.unwrap_or(0).max(after).saturating_add(step);
        }
        Ok(())
    }

    fn message(
        &self,
        row: &rusqlite::Row<'_>,
        topics: &HashMap<i64, Topic>,
        (collector, count): (&mut Collector<'_>, &mut Count),
    ) -> Result<(), ImportError> {
        let spent = ImportError::budget(self.path);
        self.budget.step(STEPS_OF_A_ROW).map_err(&spent)?;
        count.last = Some(row.get(0).map_err(|error| self.broken(&error))?);
        let (id, stamp): (Option<i64>, Option<i64>) = (row.get(1).ok(), row.get(2).ok());
        let data = row.get_ref(3).ok().and_then(|data| data.as_blob().ok());
        let (Some(topic), Some(stamp), Some(data)) = (id.and_then(|id| topics.get(&id)), stamp, data) else {
            count.odd += 1;
            return Ok(());
        };
        // Recorded with `--compression-mode message`; what cannot be unpacked is no message, and named as such.
        let unpacked = Packing::of(data).and_then(|packing| packing.unpack(data, budget::unpacked(data.len())).ok());
        let data = unpacked.as_deref().unwrap_or(data);
        self.budget.step(data.len() / BYTES_OF_A_STEP).map_err(&spent)?;
        let incoming = Incoming {
            topic: &topic.name,
            type_name: &topic.type_name,
            definition: &topic.definition,
            log_time_ns: u64::try_from(stamp).unwrap_or(0),
            data,
        };
        count.read += 1;
        collector.take(&incoming).map_err(&spent)
    }

    /// Whether there is a table of that name.
    ///
    /// # Errors
    /// [`ImportError`] when something else has that name, or its columns are calculated.
    fn has_table(&self, name: &str) -> Result<bool, ImportError> {
        let broken = |error| self.broken(&error);
        let refused = |what: &str| {
            let what = format!(
                "`{name}` is {what}, and no table that `ros2 bag record` has written; copy the bag from its source again"
            );
            ImportError::log(self.path, what)
        };
        let mut named = self
            .connection
            .prepare("SELECT type, sql FROM sqlite_schema WHERE name = ?1 COLLATE NOCASE AND type <> 'index'")
            .map_err(broken)?;
        let mut rows = named.query([name]).map_err(broken)?;
        let Some(row) = rows.next().map_err(broken)? else { return Ok(false) };
        let (kind, sql): (String, String) = (row.get(0).map_err(broken)?, row.get(1).map_err(broken)?);
        if kind != "table" {
            return Err(refused(&format!("a {kind}")));
        }
        // SQLite writes these two words itself, in capitals and apart by one blank.
        if !sql.starts_with("CREATE TABLE") {
            return Err(refused("the table of a module"));
        }
        let calculated: i64 = self
            .connection
            .query_row("SELECT count(*) FROM pragma_table_xinfo(?1) WHERE hidden <> 0", [name], |row| row.get(0))
            .map_err(broken)?;
        if calculated > 0 { Err(refused("a table with columns that are calculated")) } else { Ok(true) }
    }

    fn topics(&self) -> Result<HashMap<i64, Topic>, ImportError> {
        let broken = |error: rusqlite::Error| self.broken(&error);
        let spent = ImportError::budget(self.path);
        let keep = |bytes: usize| self.budget.take(bytes + size_of::<Topic>()).map_err(&spent);
        let mut definitions: HashMap<String, Rc<[u8]>> = HashMap::new();
        // Since ROS 2 Iron.
        if self.has_table("message_definitions")? {
            let mut statement = self
                .connection
                .prepare(
                    "SELECT topic_type, encoded_message_definition FROM message_definitions WHERE encoding = 'ros2msg'",
                )
                .map_err(broken)?;
            let rows = statement.query_map([], |row| Ok((row.get(0)?, row.get::<_, String>(1)?))).map_err(broken)?;
            for row in rows {
                let (type_name, text): (String, String) = row.map_err(broken)?;
                keep(type_name.len() + text.len())?;
                definitions.insert(type_name, text.into_bytes().into());
            }
        }
        let none: Rc<[u8]> = Rc::new([]);
        let mut statement = self.connection.prepare("SELECT id, name, type FROM topics").map_err(broken)?;
        let rows = statement
            .query_map([], |row| Ok((row.get::<_, i64>(0)?, row.get::<_, String>(1)?, row.get::<_, String>(2)?)))
            .map_err(broken)?;
        let mut topics = HashMap::new();
        for row in rows {
            let (id, name, type_name) = row.map_err(broken)?;
            keep(name.len() + type_name.len())?;
            let definition = Rc::clone(definitions.get(&type_name).unwrap_or(&none));
            topics.insert(id, Topic { name, type_name, definition });
        }
        Ok(topics)
    }
}

/// What is wrong with a database, or why it is not read further.
fn broken(path: &Path, budget: &Budget, error: &rusqlite::Error) -> ImportError {
    // The database is interrupted by nothing but its budget; asked again, that says why.
    let interrupted = error.sqlite_error_code() == Some(ErrorCode::OperationInterrupted);
    if let (true, Err(over)) = (interrupted, budget.step(INSTRUCTIONS)) {
        return ImportError::budget(path)(over);
    }
    ImportError::log(path, format!("is no whole bag ({error}); copy it from its source again, or leave it out"))
}
