//! The one network session of a link: its settings, what it lets in and out, and the names on the network.

use crate::crossing::Plan;
use crate::endpoint::Endpoint;
use crate::{LinkError, Side};
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

/// Why an address cannot be listened at.
pub(super) fn refused(side: &Side, what: String) -> LinkError {
    match side {
        Side::Listen(endpoint) => LinkError::Listen { endpoint: endpoint.clone(), what: cause(&what, endpoint) },
        Side::Connect(endpoint) => LinkError::NotReached { endpoint: endpoint.clone(), what: cause(&what, endpoint) },
    }
}

/// What the system said, out of a chain of errors that repeats the address.
pub(super) fn cause(what: &str, endpoint: &Endpoint) -> String {
    let system = what.rfind("(os error").map(|end| &what[..end]);
    let words = system.and_then(|words| words.rsplit([':', '"', '(', '[', ']']).next()).map(str::trim);
    match words {
        Some(words) if !words.is_empty() => words.to_owned(),
        _ if what.contains("deadline") || what.to_lowercase().contains("timeout") => "no answer".into(),
        _ if what.contains("Unable to connect") => "no answer".into(),
        _ => what.replace(&endpoint.to_string(), "it").lines().next().unwrap_or("").to_owned(),
    }
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
