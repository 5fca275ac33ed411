//! What single stages say by themselves: a picture of each number that is more than chance, and a table of all.

use crate::answer::witnessed_number;
use crate::page::figure::regression::Fitted;
use crate::words::words;
use inference::witness::Witness;
use maud::{Markup, html};

/// The section; nothing where there is no witness.
pub(super) fn section(witnesses: &[Witness]) -> Markup {
    let shown = witnesses.iter().filter(|witness| witness.is_significant());
    html! {
        @if !witnesses.is_empty() {
            section {
                h2 { "What single stages say, without a roll-out" }
                p.note {
                    "Each point is a clip; the line is the number, dashed lines are two standard errors to either side. \
                     Nothing of the hit, of friction or of gains is in it."
                }
                div.pair { @for witness in shown { figure { (picture(witness)) } } }
                table {
                    tr {
                        th { "stage" } th { "effect" } th { "number" }
                        th.n { "standard errors from zero" } th.n { "clips" } th { "would look alike" }
                    }
                    @for witness in witnesses {
                        tr {
                            td { (witness.stage) }
                            td { (words(witness.effect)) }
                            td { (witnessed_number(witness)) }
                            td.n { (format!("{:.1}", witness.t)) }
                            td.n { (witness.clips) }
                            td { (witness.confusable_with.iter().map(|effect| words(effect)).collect::<Vec<_>>().join(", ")) }
                        }
                    }
                }
            }
        }
    }
}

fn picture(witness: &Witness) -> Markup {
    let title = format!("{}: {}", words(witness.effect), witnessed_number(witness));
    let fitted = Fitted {
        title: &title,
        x: [witness.against.name, witness.against.unit],
        y: [witness.measured.name, witness.measured.unit],
        points: &witness.points,
        value: witness.value,
        error: witness.error,
        level: witness.is_level(),
    };
    fitted.draw()
}

#[cfg(test)]
mod tests {
    use super::*;
    use inference::witness::Axis;

    #[test]
    fn what_is_more_than_chance_has_a_picture_and_all_stand_in_the_table() {
        let witness = |t: f64| Witness {
            effect: "camera_latency",
            number: "latency",
            stage: "contact",
            value: 1e-3 * t,
            error: 1e-3,
            t,
            unit: "s",
            clips: 2,
            confusable_with: vec!["tracker_smoothing"],
            against: Axis { name: "speed of the push", unit: "m/s" },
            measured: Axis { name: "how deep", unit: "m" },
            points: vec![[0.1, 1e-4 * t], [0.2, 2e-4 * t]],
        };
        let html = section(&[witness(20.0), witness(0.5)]).into_string();
        assert_eq!((html.matches("<svg").count(), html.matches("<td>contact</td>").count()), (1, 2));
        assert!(html.contains("latency 20.0 \u{b1} 1.0 ms") && html.contains("tracker smoothing"), "{html}");
        assert!(section(&[]).into_string().is_empty());
    }
}
