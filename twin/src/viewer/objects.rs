//! The objects in the live view: the first on `/object/pose` and `/twin/object`, each of the others on `/object/NAME/pose` and
//! `/twin/object/NAME`, and all of them in the scene.

use super::frames::{Look, object_frame};
use super::scene::Scene;
use super::{Viewer, ViewerError};
use foxglove::Channel;
use foxglove::messages::{PoseInFrame, Timestamp};
use shared_mem::frames::{Base, Object, Pose};
use shared_mem::msg::object::{NamedPose, ObjectName};
use shared_mem::msg::twin::TwinObject;
use shared_mem::topics::{self, OBJECT_POSE};
use shared_mem::transport::Subscriber;

/// Where an object's poses go.
pub(super) struct ObjectChannels {
    name: ObjectName,
    real: Channel<PoseInFrame>,
    twin: Channel<PoseInFrame>,
}

/// Those of all objects of a scene; of the first also where it has none.
pub(super) fn channels(scene: &Scene, open: impl Fn(&str) -> Channel<PoseInFrame>) -> Vec<ObjectChannels> {
    let first = scene.names().next().unwrap_or_default();
    let first = ObjectChannels { name: first, real: open(OBJECT_POSE.name), twin: open("/twin/object") };
    let other = |name: ObjectName| ObjectChannels {
        name,
        real: open(&topics::object_pose(name.text())),
        twin: open(&topics::twin_object(name.text())),
    };
    [first].into_iter().chain(scene.names().skip(1).map(other)).collect()
}

impl Viewer {
    /// An object by its number, where its pose is known.
    pub(super) fn show_object(&self, time: Timestamp, look: Look, number: usize, pose: Option<Pose<Base, Object>>) {
        let (Some(pose), Some(channels)) = (pose.map(|pose| pose.isometry()), self.objects.get(number)) else { return };
        let channel = if look == Look::Real { &channels.real } else { &channels.twin };
        channel.log(&self.scene.pose_in_base(time, &pose));
        let frame = object_frame(number, &channels.name);
        self.transforms.log(&self.scene.frames().object(time, look, &frame, &pose));
        if let Some(update) = self.scene.object(time, look, number, &pose) {
            self.scenes.log(&update);
        }
    }

    /// The newest of each object beside the first, as it is and in the twin.
    pub(super) fn show_others(
        &mut self,
        time: Timestamp,
        real: &Subscriber<NamedPose>,
        twin: &Subscriber<TwinObject>,
    ) -> Result<(), ViewerError> {
        let mut newest = vec![[None; 2]; self.objects.len()];
        let number = |name: &ObjectName| self.objects.iter().position(|other| other.name == *name).filter(|n| *n > 0);
        while let Some(pose) = real.receive()? {
            if let Some(number) = number(&pose.name) {
                newest[number][0] = pose.unnamed().pose();
            }
        }
        let mut seen = Vec::new();
        while let Some(object) = twin.receive()? {
            if let Some(number) = number(&object.name) {
                newest[number][1] = Pose::from_parts(object.position, object.wxyz);
            }
            seen.push(object);
        }
        if let Some(live) = &mut self.live {
            seen.iter().for_each(|object| live.remember_object(object));
        }
        for (number, [real, twin]) in newest.into_iter().enumerate() {
            self.show_object(time, Look::Real, number, real);
            self.show_object(time, Look::Twin, number, twin);
        }
        Ok(())
    }
}
