//! What views agree on: a depth counts where other views put the place of the pixel at the same pixel and at the same depth (Schoenberger et
//! al. 2016, section 5), and becomes the mean of theirs.

use crate::camera::{Depth, View};
use crate::plane::{Lens, Pair};
use crate::sweep::Cells;
use rayon::prelude::*;

/// Views agree that put a place no farther away [pixel], and at the same depth but for this share of it.
const SAME_PIXEL: f32 = 1.0;
const SAME_DEPTH: f32 = 0.01;
/// So many other views must.
const FEWEST: usize = 2;
/// Pictures more unlike than this about a place do not show the same.
const UNLIKE: f32 = 0.6;

/// The depths of a view that others agree on; of each other view with its planes.
pub(crate) fn agreed(views: &[View], planes: &[Cells], of: usize, others: &[usize]) -> Depth {
    let view = &views[of];
    let (lens, [width, height]) = (Lens::of(&view.camera), view.camera.size);
    let pairs: Vec<(usize, Pair, Pair)> = others
        .iter()
        .map(|other| (*other, Pair::new(view, &views[*other], 1), Pair::new(&views[*other], view, 1)))
        .collect();
    let pixel = |number: usize| {
        let (column, row) = (number % width, number / width);
        let (at, cell) = ([column as f32 + 0.5, row as f32 + 0.5], planes[of].at(column, row));
        let none = (f32::NAN, [f32::NAN; 3], 0.0);
        if cell.cost > UNLIKE {
            return none;
        }
        let (mut agree, mut deny, mut sum) = (0usize, 0usize, cell.plane.inverse);
        for (other, there, back) in &pairs {
            let Some(seen) = there.place(at, cell.plane.inverse) else { continue };
            let Some((their, middle)) = planes[*other].around(seen.at) else { continue };
            let inverse = their.plane.moved([seen.at[0] - middle[0], seen.at[1] - middle[1]]).inverse;
            let Some(again) = back.place(seen.at, inverse) else { continue };
            let away = [0, 1].map(|i| again.at[i] - at[i]);
            let same = (again.inverse / cell.plane.inverse - 1.0).abs() < SAME_DEPTH;
            if same && away[0].hypot(away[1]) < SAME_PIXEL {
                agree += 1;
                sum += again.inverse - cell.plane.slope[0] * away[0] - cell.plane.slope[1] * away[1];
            } else if inverse < seen.inverse * (1.0 - SAME_DEPTH) && their.cost < UNLIKE {
                // It sees through the place.
                deny += 1;
            }
        }
        if agree < FEWEST || deny > agree {
            return none;
        }
        let share = agree as f32 / (agree + deny) as f32;
        ((agree + 1) as f32 / sum, cell.plane.normal(at, &lens), share * (1.0 - cell.cost).clamp(0.0, 1.0))
    };
    let all: Vec<(f32, [f32; 3], f32)> = (0..width * height).into_par_iter().map(pixel).collect();
    Depth {
        depth: all.iter().map(|pixel| pixel.0).collect(),
        normal: all.iter().map(|pixel| pixel.1).collect(),
        confidence: all.iter().map(|pixel| pixel.2).collect(),
    }
}
