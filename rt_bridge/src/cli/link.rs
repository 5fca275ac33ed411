//! `rt_bridge link`.

use super::stop_flag;
use anyhow::Result;
use clap::{ArgGroup, Args};
use link::crossing::{Plan, Topics, commands, states};
use link::endpoint::Endpoint;
use link::{Settings, Side, run};
use shared_mem::answer;
use shared_mem::quantity::seconds;
use std::time::Duration;

/// Topics of the robot's host on another host, over the network, until Ctrl-C
///
/// Start it on the robot's host with --listen and on the other one with --connect: twin, viewer and recorder there read
/// shared memory as they would beside the bridge. States are sent again until they have arrived; of pictures the newest counts.
/// Messages keep the stamps of their origin; how old they are on arrival is measured by round trips, and said with its bound.
/// After a pulled cable the hosts find each other again by themselves.
///
/// Commands do not cross. --take-commands on the robot's host lets those in that it names, from whoever reaches the port; it is
/// not encrypted, so open it in a network of your own or inside a tunnel. docs/link.md has more.
///
/// The network is an optional part of the program: one that was built without it says how to build it.
#[derive(Debug, Args)]
#[command(
    group(ArgGroup::new("side").required(true).args(["listen", "connect"])),
    after_help = "Examples:\n  \
    rt_bridge link --listen tcp/0.0.0.0:7447                                the robot's host\n  \
    rt_bridge link --connect tcp/192.168.1.20:7447                          the other host: all states and pictures\n  \
    rt_bridge link --connect tcp/192.168.1.20:7447 --topics /arm/state,/object/pose --send /twin/state,/twin/gap\n  \
    rt_bridge link --listen tcp/0.0.0.0:7447 --topics /twin/state,/twin/gap\n  \
    rt_bridge link --listen tcp/0.0.0.0:7447 --take-commands /arm/target\n  \
    rt_bridge link --connect tcp/192.168.1.20:7447 --send-commands /arm/target --duration 60 --json\n\n\
    JSON: sent (topic, messages, bytes, repeated, dropped), taken (topic, messages, bytes, lost, refused, age_us from shared\n\
    memory there to shared memory here), clock (offset of the other host's and its uncertainty [s], round_trips,\n\
    round_trip_us), outages, longest_outage [s]."
)]
pub struct LinkArguments {
    /// Address of this host that the other connects to, tcp/HOST:PORT; 0.0.0.0 for all of them
    #[arg(long, value_name = "ADDRESS")]
    listen: Option<Endpoint>,
    /// Address at which the other host listens, tcp/HOST:PORT
    #[arg(long, value_name = "ADDRESS")]
    connect: Option<Endpoint>,
    /// Topics of the other host to publish here, with commas between them, or none. Default: with --connect all states and
    /// pictures of a cell, with --listen none
    #[arg(long, value_name = "TOPICS", value_parser = states)]
    topics: Option<Topics>,
    /// Topics of this host that the other may have, or none. Default: with --listen all states and pictures of a cell, with
    /// --connect none
    #[arg(long, value_name = "TOPICS", value_parser = states)]
    send: Option<Topics>,
    /// Commands of the other host to let in: /arm/target, /gripper/target
    #[arg(long, value_name = "TOPICS", value_parser = commands)]
    take_commands: Option<Topics>,
    /// Commands of this host to send
    #[arg(long, value_name = "TOPICS", value_parser = commands)]
    send_commands: Option<Topics>,
    /// Stop after this many seconds; exit code 1 where the other host was not reached until then
    #[arg(long, value_name = "S", value_parser = seconds)]
    duration: Option<Duration>,
    /// End when this process is no longer our parent
    #[arg(long, hide = true)]
    parent: Option<u32>,
    /// Answer with one JSON object
    #[arg(long)]
    json: bool,
}

impl LinkArguments {
    pub(super) fn execute(self) -> Result<()> {
        let stop = stop_flag(self.parent)?;
        let (listens, side) = match (self.listen, self.connect) {
            (Some(endpoint), _) => (true, Side::Listen(endpoint)),
            (None, Some(endpoint)) => (false, Side::Connect(endpoint)),
            (None, None) => anyhow::bail!("give --listen or --connect"),
        };
        let plan = Plan::new(listens, [self.send, self.topics], [self.send_commands, self.take_commands])?;
        let report = run(&Settings { side, plan, duration: self.duration }, &stop)?;
        if self.json {
            answer::json(&report)?;
        } else {
            answer::words(report.in_words())?;
        }
        Ok(())
    }
}
