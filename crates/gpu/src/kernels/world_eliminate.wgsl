// Elimination of the unknowns of few contacts under load: I + L^T W L by the method of Gauss and Jordan, a row a thread. It searches for no pivots, which a symmetric positive definite matrix does not
// need. A thread keeps its row in registers, which it can only address by constants: so the row moves on by a number in each step, and the unknown of the step is always the first one.

// Contacts whose rows, three each, have room.
const MOST_ELIMINATED: u32 = 10u;
// Vectors of four numbers of a row.
const ROW: u32 = 8u;

// What a step hands on, in turns, so that it has one barrier: a number of each row behind the pivot's, which by symmetry are the pivot's row; and at the end right-hand side and pivot.
var<workgroup> handed_on: array<vec4f, 2u * (ROW + 1u)>;

// Solves for the right-hand side, in its place. A barrier at the end.
fn eliminate(size: u32) {
    let contact = thread / 3u;
    let axis = thread % 3u;
    var number = 0u;
    var column = vec3f(0.0);
    var b = 0.0;
    if contact < size {
        number = loaded[contact];
        column = column_of(roots[number], axis);
        b = right[contact][axis];
    }
    var r_0 = vec4f(0.0);
    var r_1 = vec4f(0.0);
    var r_2 = vec4f(0.0);
    var r_3 = vec4f(0.0);
    var r_4 = vec4f(0.0);
    var r_5 = vec4f(0.0);
    var r_6 = vec4f(0.0);
    var r_7 = vec4f(0.0);
    // From the last contact to the first, whose numbers come in front.
    for (var left = size; left > 0u; left--) {
        let other = left - 1u;
        var three = (column * block(number, loaded[other])) * roots[loaded[other]];
        // Rows and columns behind the rank are those of the unit matrix.
        three += select(vec3f(0.0), unit(axis), other == contact);
        r_7 = vec4f(r_6.yzw, r_7.x);
        r_6 = vec4f(r_5.yzw, r_6.x);
        r_5 = vec4f(r_4.yzw, r_5.x);
        r_4 = vec4f(r_3.yzw, r_4.x);
        r_3 = vec4f(r_2.yzw, r_3.x);
        r_2 = vec4f(r_1.yzw, r_2.x);
        r_1 = vec4f(r_0.yzw, r_1.x);
        r_0 = vec4f(three, r_0.x);
    }
    var pivot = 1.0;
    for (var step = 0u; step < 3u * size; step++) {
        let at = (step & 1u) * (ROW + 1u);
        if thread > step {
            let behind = thread - step - 1u;
            handed_on[at + behind / 4u][behind % 4u] = r_0.x;
        }
        if thread == step {
            handed_on[at + ROW] = vec4f(b, r_0.x, 0.0, 0.0);
        }
        workgroupBarrier();
        let of_pivot = handed_on[at + ROW];
        var times = r_0.x / of_pivot.y;
        if thread == step {
            pivot = of_pivot.y;
            times = 0.0;
        }
        b -= times * of_pivot.x;
        r_0 = vec4f(r_0.yzw, r_1.x) - times * handed_on[at];
        r_1 = vec4f(r_1.yzw, r_2.x) - times * handed_on[at + 1u];
        r_2 = vec4f(r_2.yzw, r_3.x) - times * handed_on[at + 2u];
        r_3 = vec4f(r_3.yzw, r_4.x) - times * handed_on[at + 3u];
        r_4 = vec4f(r_4.yzw, r_5.x) - times * handed_on[at + 4u];
        r_5 = vec4f(r_5.yzw, r_6.x) - times * handed_on[at + 5u];
        r_6 = vec4f(r_6.yzw, r_7.x) - times * handed_on[at + 6u];
        r_7 = vec4f(r_7.yzw, 0.0) - times * handed_on[at + 7u];
    }
    if contact < size {
        right[contact][axis] = b / pivot;
    }
    workgroupBarrier();
}
