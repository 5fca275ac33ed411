//! Which topics of a clip hold the poses of which object: the one that a command is about first, then the others.
//!
//! An object with a name is on `/object/NAME/pose`, in a ROS 2 bag on the `topic` of its block where that is given; without a
//! name on `/object/pose`, in a bag on `object_pose` of `[topics]`. The first object of a cell.toml is on that one, too, where
//! the file has nothing on its own: so are clips that were recorded before objects had names. Parts of an object that moves in
//! itself are on `/object/NAME_LINK/pose` and come behind all objects.

use super::checks;
use super::clip::{Clip, TrackedObject};
use super::error::ReadError;
use super::series::ObjectSeries;
use crate::cell::{Cell, Object};
use crate::frames::{Base, Object as ObjectFrame, Pose};
use crate::topics;
use std::collections::BTreeMap;

/// A stamp [ns] and the pose, `None` where its numbers are no pose.
pub(super) type PoseRow = (u64, Option<Pose<Base, ObjectFrame>>);

/// Topics by object.
pub(super) struct ObjectTopics {
    /// Name, and where to look, the best place first.
    objects: Vec<(String, Vec<String>)>,
    /// What topics of parts begin with.
    parts: Vec<String>,
}

impl ObjectTopics {
    /// In own clips.
    pub(super) fn own(cell: &Cell) -> Self {
        Self::of(cell, topics::OBJECT_POSE.name, &own_topic)
    }

    /// In ROS 2 bags.
    pub(super) fn ros2(cell: &Cell) -> Self {
        Self::of(cell, &cell.topics.object_pose, &|object| ros2_topic(cell, object))
    }

    fn of(cell: &Cell, common: &str, topic: &dyn Fn(&Object) -> String) -> Self {
        let named = |object: &Object| {
            let mut choice = vec![topic(object)];
            let is_first = cell.objects.first().is_some_and(|first| std::ptr::eq(first, object));
            if is_first && choice[0] != common {
                choice.push(common.to_owned());
            }
            (object.name.clone().unwrap_or_default(), choice)
        };
        let first = cell.object().map_or_else(|| (String::new(), vec![common.to_owned()]), named);
        let articulated = cell.objects.iter().filter(|object| object.urdf.is_some());
        let parts = articulated.filter_map(|object| Some(format!("/object/{}_", object.name.as_deref()?))).collect();
        Self { objects: [first].into_iter().chain(cell.other_objects().map(named)).collect(), parts }
    }

    /// Whether poses on this topic are of use.
    pub(super) fn wants(&self, topic: &str) -> bool {
        let of_part = || topics::object_of(topic, "pose").is_some() && self.parts.iter().any(|p| topic.starts_with(p));
        self.objects.iter().any(|(_, choice)| choice.iter().any(|wanted| wanted == topic)) || of_part()
    }

    /// Where the object in question should be.
    pub(super) fn expected(&self) -> &str {
        &self.objects[0].1[0]
    }

    /// What there is of each object: its name, its topic and what was collected there, nothing where it is on none.
    pub(super) fn take<T: Default>(&self, there: &mut BTreeMap<String, T>) -> Vec<(String, String, T)> {
        let one = |(name, choice): &(String, Vec<String>)| {
            let topic = choice.iter().find(|topic| there.contains_key(*topic)).unwrap_or(&choice[0]);
            (name.clone(), topic.clone(), there.remove(topic).unwrap_or_default())
        };
        let mut taken: Vec<_> = self.objects.iter().map(one).collect();
        let of_parts: Vec<String> =
            there.keys().filter(|topic| self.parts.iter().any(|part| topic.starts_with(part))).cloned().collect();
        for topic in of_parts {
            let name = topics::object_of(&topic, "pose").unwrap_or_default().to_owned();
            taken.push((name, topic.clone(), there.remove(&topic).unwrap_or_default()));
        }
        taken
    }
}

/// Where an own clip has an object's poses.
pub(super) fn own_topic(object: &Object) -> String {
    object.name.as_deref().map_or_else(|| topics::OBJECT_POSE.name.to_owned(), topics::object_pose)
}

/// Where a bag has them.
pub(super) fn ros2_topic(cell: &Cell, object: &Object) -> String {
    let by_name = || object.name.as_deref().map(topics::object_pose);
    object.topic.clone().or_else(by_name).unwrap_or_else(|| cell.topics.object_pose.clone())
}

/// Checks what was collected of one object and puts it into the clip: the first is the one in question.
pub(super) fn put(
    clip: &mut Clip,
    number: usize,
    name: String,
    topic: &str,
    rows: Vec<PoseRow>,
) -> Result<(), ReadError> {
    let path = clip.file.clone();
    let fail = |what| ReadError::content(&path, topic, what);
    let (series, found) = checks::object(rows, topic).map_err(fail)?;
    clip.warnings.extend(found);
    let (series, warning) = checks::beside_arm(series, &clip.measured, topic).map_err(fail)?;
    clip.warnings.extend(warning);
    match number {
        0 => clip.object = series,
        _ => clip.others.push(TrackedObject { name, series }),
    }
    Ok(())
}

/// The poses of all objects of a clip by time, for whoever writes them in between other things.
pub(super) struct Due<'a> {
    objects: Vec<DueObject<'a>>,
}

struct DueObject<'a> {
    series: &'a ObjectSeries,
    topics: Vec<String>,
    next: usize,
}

/// A pose that is to be written.
pub(super) struct DuePose<'a> {
    /// On each of these.
    pub(super) topics: &'a [String],
    /// Its place in the series.
    pub(super) row: usize,
    pub(super) pose: &'a Pose<Base, ObjectFrame>,
}

impl<'a> Due<'a> {
    /// For an own clip.
    pub(super) fn own(clip: &'a Clip, cell: &Cell) -> Self {
        Self::of(clip, ObjectTopics::own(cell))
    }

    /// For a ROS 2 bag.
    pub(super) fn ros2(clip: &'a Clip, cell: &Cell) -> Self {
        Self::of(clip, ObjectTopics::ros2(cell))
    }

    fn of(clip: &'a Clip, topics: ObjectTopics) -> Self {
        let series = [&clip.object].into_iter().chain(clip.others.iter().map(|other| &other.series));
        let parts = clip.others.iter().skip(topics.objects.len().saturating_sub(1));
        let of_parts = parts.map(|part| vec![topics::object_pose(&part.name)]);
        let all = topics.objects.into_iter().map(|(_, topics)| topics).chain(of_parts).zip(series);
        Self { objects: all.map(|(topics, series)| DueObject { series, topics, next: 0 }).collect() }
    }

    /// When the next pose is due [ns].
    pub(super) fn next_ns(&self) -> Option<u64> {
        self.objects.iter().filter_map(|object| object.series.stamps_ns.get(object.next).copied()).min()
    }

    /// One of the poses with this stamp, each once.
    pub(super) fn take(&mut self, stamp_ns: u64) -> Option<DuePose<'_>> {
        let due = |object: &&mut DueObject<'_>| object.series.stamps_ns.get(object.next) == Some(&stamp_ns);
        let object = self.objects.iter_mut().find(due)?;
        object.next += 1;
        let row = object.next - 1;
        Some(DuePose { topics: &object.topics, row, pose: object.series.poses.get(row)? })
    }
}
