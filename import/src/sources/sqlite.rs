//! ROS 2 bags of the storage sqlite3: one database a file, opened without being changed.

use super::go_on;
use crate::error::ImportError;
use crate::ros::{Collector, Incoming};
use rusqlite::{Connection, OpenFlags};
use std::collections::HashMap;
use std::path::Path;

/// A topic by its number in the database.
struct Topic {
    name: String,
    type_name: String,
    definition: Vec<u8>,
}

pub(super) fn read(path: &Path, collector: &mut Collector) -> Result<(), ImportError> {
    shared_mem::input::open(path)?;
    let broken = |error: rusqlite::Error| {
        ImportError::log(path, format!("is no whole bag ({error}); copy it from its source again, or leave it out"))
    };
    let connection = open(path).map_err(broken)?;
    let verdict: String = connection.query_row("PRAGMA quick_check(1)", [], |row| row.get(0)).map_err(broken)?;
    if verdict != "ok" {
        let verdict = verdict.replace('\n', " ");
        return Err(ImportError::log(
            path,
            format!("is damaged ({verdict}); copy it from its source again, or leave it out"),
        ));
    }
    let topics = topics(&connection, path)?;
    let mut statement =
        connection.prepare("SELECT topic_id, timestamp, data FROM messages ORDER BY timestamp, id").map_err(broken)?;
    let mut rows = statement.query([]).map_err(broken)?;
    let mut count = 0_u64;
    while let Some(row) = rows.next().map_err(broken)? {
        count += 1;
        if count.is_multiple_of(1024) {
            go_on(path)?;
        }
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
        collector.take(&incoming).map_err(|what| ImportError::log(path, what))?;
    }
    Ok(())
}

fn open(path: &Path) -> Result<Connection, rusqlite::Error> {
    // Where a recorder left a journal the database has to take it in, elsewhere nothing is locked or written.
    let journal = path.with_extension("db3-wal");
    let mode = if journal.exists() { "mode=ro" } else { "immutable=1" };
    let absolute = std::path::absolute(path).unwrap_or_else(|_| path.to_owned());
    let escaped: String = absolute.to_string_lossy().replace('%', "%25").replace('?', "%3f").replace('#', "%23");
    let flags = OpenFlags::SQLITE_OPEN_READ_ONLY | OpenFlags::SQLITE_OPEN_URI | OpenFlags::SQLITE_OPEN_NO_MUTEX;
    Connection::open_with_flags(format!("file:{escaped}?{mode}"), flags)
}

fn topics(connection: &Connection, path: &Path) -> Result<HashMap<i64, Topic>, ImportError> {
    let broken = |error: rusqlite::Error| {
        ImportError::log(path, format!("is no ROS 2 bag ({error}); give a database that `ros2 bag record` has written"))
    };
    let mut definitions: HashMap<String, Vec<u8>> = HashMap::new();
    // Since ROS 2 Iron.
    if connection.table_exists(None, "message_definitions").map_err(broken)? {
        let mut statement = connection
            .prepare(
                "SELECT topic_type, encoded_message_definition FROM message_definitions WHERE encoding = 'ros2msg'",
            )
            .map_err(broken)?;
        let rows = statement.query_map([], |row| Ok((row.get(0)?, row.get::<_, String>(1)?))).map_err(broken)?;
        for row in rows {
            let (type_name, text) = row.map_err(broken)?;
            definitions.insert(type_name, text.into_bytes());
        }
    }
    let mut statement = connection.prepare("SELECT id, name, type FROM topics").map_err(broken)?;
    let rows = statement
        .query_map([], |row| Ok((row.get::<_, i64>(0)?, row.get::<_, String>(1)?, row.get::<_, String>(2)?)))
        .map_err(broken)?;
    let mut topics = HashMap::new();
    for row in rows {
        let (id, name, type_name) = row.map_err(broken)?;
        let definition = definitions.get(&type_name).cloned().unwrap_or_default();
        topics.insert(id, Topic { name, type_name, definition });
    }
    Ok(topics)
}
