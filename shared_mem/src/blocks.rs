//! Blocks of a TOML file of which there is one without a name, `[object]`, or one for each name, `[[object]]`. For
//! `#[serde(with = "blocks")]`.

use serde::de::value::{MapAccessDeserializer, SeqAccessDeserializer};
use serde::de::{MapAccess, SeqAccess, Visitor};
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use std::fmt;
use std::marker::PhantomData;

/// A block that may have a name.
pub(crate) trait Named {
    /// Its key in the file.
    const KEY: &'static str;

    /// Its name.
    fn name(&self) -> Option<&str>;
}

/// Writes `[key]` where there is one without a name, else `[[key]]`.
pub(crate) fn serialize<T: Named + Serialize, S: Serializer>(blocks: &[T], serializer: S) -> Result<S::Ok, S::Error> {
    match blocks {
        [only] if only.name().is_none() => only.serialize(serializer),
        all => all.serialize(serializer),
    }
}

/// Reads either.
pub(crate) fn deserialize<'de, T: Named + Deserialize<'de>, D: Deserializer<'de>>(
    deserializer: D,
) -> Result<Vec<T>, D::Error> {
    struct Either<T>(PhantomData<T>);
    impl<'de, T: Named + Deserialize<'de>> Visitor<'de> for Either<T> {
        type Value = Vec<T>;

        fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
            write!(f, "an [{0}] block, or [[{0}]] blocks", T::KEY)
        }

        fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<Self::Value, A::Error> {
            T::deserialize(MapAccessDeserializer::new(map)).map(|block| vec![block])
        }

        fn visit_seq<A: SeqAccess<'de>>(self, list: A) -> Result<Self::Value, A::Error> {
            Vec::deserialize(SeqAccessDeserializer::new(list))
        }
    }
    deserializer.deserialize_any(Either(PhantomData))
}

/// What is wrong with a text that has both forms, which TOML itself calls a duplicate key.
pub(crate) fn both_forms<T: Named>(text: &str) -> Option<String> {
    let key = T::KEY;
    let has =
        |header: String| text.lines().any(|line| line.split('#').next().is_some_and(|line| line.trim() == header));
    (has(format!("[{key}]")) && has(format!("[[{key}]]")))
        .then(|| format!("holds both [{key}] and [[{key}]]; write each as [[{key}]] with a `name`"))
}

/// What is wrong with the names of blocks: of several each has one of its own.
pub(crate) fn check_names<T: Named>(blocks: &[T]) -> Result<(), String> {
    for (i, block) in blocks.iter().enumerate() {
        match block.name() {
            None if blocks.len() > 1 => {
                return Err(format!("[[{}]] number {} has no `name`; of several each needs one", T::KEY, i + 1));
            }
            Some(name) if blocks[..i].iter().any(|before| before.name() == Some(name)) => {
                return Err(format!("two [[{}]] blocks are named `{name}`; give each a name of its own", T::KEY));
            }
            _ => {}
        }
    }
    Ok(())
}
