//! ROS 2 bags of the storage sqlite3: one database a file, opened without being changed.
//!
//! A database brings queries of its own along: a view may take the place of a table, a column be calculated when it is read, and
//! either may have no end. Only plain tables are read; what they take is drawn from the budget of the bag.

use crate::error::ImportError;
use crate::ros::{Collector, Incoming};
use rusqlite::config::DbConfig;
use rusqlite::limits::Limit;
use rusqlite::{Connection, ErrorCode, OpenFlags};
use shared_mem::budget::Budget;
use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::rc::Rc;

/// Instructions of the database's machine between two looks at the budget: some microseconds.
const INSTRUCTIONS: usize = 1000;
/// Instructions are steps; whatever else a row takes is these.
const STEPS_OF_A_ROW: usize = 16;
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

pub(super) fn read(path: &Path, collector: &mut Collector<'_>) -> Result<(), ImportError> {
    shared_mem::input::open(path)?;
    let budget = collector.budget().clone();
    let bag = Bag::open(path, &budget)?;
    bag.is_whole()?;
    for table in ["topics", "messages"] {
        if !bag.has_table(table)? {
            let what =
                format!("is no ROS 2 bag (it has no `{table}`); give a database that `ros2 bag record` has written");
            return Err(ImportError::log(path, what));
        }
    }
    let topics = bag.topics()?;
    let broken = |error| bag.broken(&error);
    let mut statement = bag
        .connection
        .prepare("SELECT topic_id, timestamp, data FROM messages ORDER BY timestamp, id")
        .map_err(broken)?;
    let mut rows = statement.query([]).map_err(broken)?;
    while let Some(row) = rows.next().map_err(broken)? {
        bag.budget.step(STEPS_OF_A_ROW).map_err(ImportError::budget(path))?;
        let id: i64 = row.get(0).map_err(broken)?;
        let stamp: i64 = row.get(1).map_err(broken)?;
        let data = row.get_ref(2).map_err(broken)?;
        let data = data.as_blob().map_err(|error| broken(error.into()))?;
        let Some(topic) = topics.get(&id) else {
            return Err(ImportError::log(
                path,
                format!("has a message of topic {id}, which it does not list: it is damaged; copy it again"),
            ));
        };
        let incoming = Incoming {
            topic: &topic.name,
            type_name: &topic.type_name,
            definition: &topic.definition,
            log_time_ns: u64::try_from(stamp).unwrap_or(0),
            data,
        };
        collector.take(&incoming).map_err(|what| what.of(path))?;
    }
    Ok(())
}

/// Where a recorder keeps what it has not yet put into the database.
pub(super) fn journal(path: &Path) -> PathBuf {
    path.with_extension("db3-wal")
}

impl<'a> Bag<'a> {
    /// Opens a database that it does not trust.
    fn open(path: &'a Path, budget: &'a Budget) -> Result<Self, ImportError> {
        // Where a recorder left a journal the database has to take it in, elsewhere nothing is locked or written.
        let mode = if journal(path).exists() { "mode=ro" } else { "immutable=1" };
        let absolute = std::path::absolute(path).unwrap_or_else(|_| path.to_owned());
        let escaped: String = absolute.to_string_lossy().replace('%', "%25").replace('?', "%3f").replace('#', "%23");
        let flags = OpenFlags::SQLITE_OPEN_READ_ONLY | OpenFlags::SQLITE_OPEN_URI | OpenFlags::SQLITE_OPEN_NO_MUTEX;
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

    /// Whether its pages fit each other. What its tables demand of their rows is not evaluated.
    fn is_whole(&self) -> Result<(), ImportError> {
        let broken = |error| self.broken(&error);
        self.connection.pragma_update(None, "ignore_check_constraints", true).map_err(broken)?;
        let verdict: String =
            self.connection.query_row("PRAGMA quick_check(1)", [], |row| row.get(0)).map_err(broken)?;
        if verdict == "ok" {
            return Ok(());
        }
        let what = format!("is damaged ({verdict}); copy it from its source again, or leave it out");
        Err(ImportError::log(self.path, what))
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
