//! The one network session of a link: its settings, what it lets in and out, and the names on the network.

use crate::crossing::Plan;
use crate::endpoint::Endpoint;
use crate::{LinkError, Side};
use std::io;
use std::net::{TcpStream, ToSocketAddrs as _};
use std::time::Duration;
use zenoh::{Config, Session, Wait};

/// Key of the questions about clock, version and topics.
pub(super) const CLOCK: &str = "twinalign/link/clock";
/// A host that says nothing for so long is gone: its connection is closed and made anew [ms].
const LEASE_MS: u64 = 1_500;
/// How long one attempt to connect may take [ms].
const OPEN_MS: u64 = 700;
/// Between two attempts [ms].
const RETRY_MS: u64 = 250;
/// How long a sender waits for a line that takes nothing: less than any topic's buffer lasts [us].
const BLOCK_US: u64 = 500_000;
/// Longest message that is taken in: a picture of the largest kind there is [bytes].
const LONGEST: usize = 128 << 20;
/// How long the end of a session may take.
const CLOSE: Duration = Duration::from_millis(300);

/// How long a bare connection may take.
const TRIAL: Duration = Duration::from_millis(400);
const NO_ANSWER: &str = "no answer";

/// Key of a topic's messages.
pub(super) fn messages(topic: &str) -> String {
    format!("twinalign/link/messages{topic}")
}

/// Key of the questions for a topic's missing messages.
pub(super) fn missing(topic: &str) -> String {
    format!("twinalign/link/missing{topic}")
}

/// Opens the session, once.
pub(super) fn open(side: &Side, plan: &Plan) -> Result<Session, String> {
    let text = settings(side, plan);
    let config = Config::from_json5(&text).map_err(|e| e.to_string())?;
    zenoh::open(config).wait().map_err(|e| e.to_string())
}

/// Ends a session; where the line is dead, the system cleans up when the process ends.
pub(super) fn close(session: Session) {
    let (done, ended) = std::sync::mpsc::channel();
    let ending = move || {
        let _unreachable = session.close().wait();
        let _nobody_waits = done.send(());
    };
    if std::thread::Builder::new().name("link end".into()).spawn(ending).is_ok() {
        let _too_slow = ended.recv_timeout(CLOSE);
    }
}

/// Why an address cannot be listened at: what the system said, out of a chain of errors that repeats the address.
pub(super) fn listening_failed(endpoint: &Endpoint, what: &str) -> LinkError {
    let system = what.rfind("(os error").map(|end| &what[..end]);
    let words = system.and_then(|words| words.rsplit([':', '"', '(', '[', ']']).next()).map(str::trim);
    let what = words.filter(|words| !words.is_empty()).unwrap_or(what.lines().next().unwrap_or("")).to_owned();
    LinkError::Listen { endpoint: endpoint.clone(), what }
}

/// Why an address is not reached: the network's library does not say, a bare connection does.
pub(super) fn why_not_reached(endpoint: &Endpoint) -> String {
    let (answer, answered) = std::sync::mpsc::channel();
    let address = endpoint.address();
    let trying = move || {
        let reach = || {
            let addresses: Vec<_> = address.to_socket_addrs()?.collect();
            let first = addresses.first().ok_or_else(|| io::Error::other("the name stands for no address"))?;
            TcpStream::connect_timeout(first, TRIAL)
        };
        let what = match reach() {
            Ok(_) => "the port is open, but no link answers".to_owned(),
            Err(error) if error.kind() == io::ErrorKind::TimedOut => NO_ANSWER.to_owned(),
            Err(error) => error.to_string(),
        };
        let _nobody_waits = answer.send(what);
    };
    // A name server that says nothing holds up this thread alone.
    let begun = std::thread::Builder::new().name("link trial".into()).spawn(trying);
    let what = begun.ok().and_then(|_| answered.recv_timeout(TRIAL).ok());
    what.unwrap_or_else(|| NO_ANSWER.into())
}

fn settings(side: &Side, plan: &Plan) -> String {
    let endpoint = |endpoint: &Endpoint| format!("[\"{endpoint}\"]");
    let (mode, listen, connect) = match side {
        Side::Listen(at) => ("peer", endpoint(at), "[]".into()),
        Side::Connect(to) => ("client", "[]".to_owned(), endpoint(to)),
    };
    format!(
        r#"{{
  mode: "{mode}",
  listen: {{ endpoints: {listen} }},
  connect: {{ endpoints: {connect}, retry: {{ period_init_ms: {RETRY_MS}, period_max_ms: {RETRY_MS}, period_increase_factor: 1 }} }},
  scouting: {{ multicast: {{ enabled: false }}, gossip: {{ enabled: false }} }},
  transport: {{
    unicast: {{ open_timeout: {OPEN_MS}, accept_timeout: {OPEN_MS}, max_sessions: 16 }},
    link: {{
      tx: {{ lease: {LEASE_MS}, queue: {{ congestion_control: {{ block: {{ wait_before_close: {BLOCK_US} }} }} }} }},
      rx: {{ max_message_size: {LONGEST} }},
    }},
  }},
  access_control: {access},
}}"#,
        access = access(plan),
    )
}

/// Everything is refused but what the plan names: a command that it does not hold ends at the network's edge.
fn access(plan: &Plan) -> String {
    let keys = |of: fn(&str) -> String, crossings: &[crate::crossing::Crossing]| -> Vec<String> {
        crossings.iter().map(|crossing| of(crossing.topic)).collect()
    };
    let [sent, asked] = [keys(messages, &plan.send), keys(missing, &plan.send)];
    let [taken, asks] = [keys(messages, &plan.take), keys(missing, &plan.take)];
    let rules = [
        ("questions", "ingress\", \"egress", "query\", \"reply\", \"declare_queryable", vec![CLOCK.to_owned()]),
        ("out", "egress", "put", [sent.clone(), asks.clone()].concat()),
        ("wanted there", "ingress", "declare_subscriber", [sent, asks].concat()),
        ("in", "ingress", "put", [taken.clone(), asked.clone()].concat()),
        ("wanted here", "egress", "declare_subscriber", [taken, asked].concat()),
    ];
    let (mut blocks, mut names) = (Vec::new(), Vec::new());
    for (name, flows, kinds, keys) in rules.into_iter().filter(|(_, _, _, keys)| !keys.is_empty()) {
        let keys = keys.join("\", \"");
        blocks.push(format!(
            r#"{{ id: "{name}", permission: "allow", flows: ["{flows}"], messages: ["{kinds}"], key_exprs: ["{keys}"] }}"#
        ));
        names.push(format!("\"{name}\""));
    }
    format!(
        r#"{{ enabled: true, default_permission: "deny", rules: [{}], subjects: [{{ id: "all" }}], policies: [{{ rules: [{}], subjects: ["all"] }}] }}"#,
        blocks.join(", "),
        names.join(", ")
    )
}
