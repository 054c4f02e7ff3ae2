// Elimination of the unknowns of contacts under load, as many for each as the rank of its response: I + L^T W L by the method of Gauss and Jordan, a row a thread. It searches for no pivots, which a symmetric positive definite matrix does not
// need. A thread keeps its row in registers, which it can only address by constants: so the row moves on by a number in each step, and the unknown of the step is always the first one.

// Vectors of four numbers of a row.
const ROW: u32 = 8u;
// Rows for which there is room: a thread each, and as many numbers in a row.
const MOST_ROWS: u32 = LANES;

// What a step hands on, in turns, so that it has one barrier: the pivot's row behind it, and at the end right-hand side and pivot. The numbers in front of the other rows are the same by symmetry, but have their own rounding: with them instead of the row, solves of many contacts that slide on one fruit
// took up to 100 iterations instead of 14.
var<workgroup> handed_on: array<vec4f, 2u * (ROW + 1u)>;
// Number of a row in the right-hand side.
var<workgroup> row_names: array<u32, LANES>;

// Names the rows of a contact under load, if there is room.
fn name_rows(number: u32, first: u32, rank: u32) {
    for (var k = 0u; k < rank && first + k < MOST_ROWS; k++) {
        row_names[first + k] = 3u * number + k;
    }
}

// Solves for the right-hand side, in its place. A barrier at the end.
fn eliminate(size: u32, rows: u32) {
    let name = row_names[thread];
    let is_row = thread < rows;
    let own = select(0u, name / 3u, is_row);
    let axis = name % 3u;
    var number = 0u;
    var column = vec3f(0.0);
    var b = 0.0;
    if is_row {
        number = loaded[own].x;
        column = column_of(roots[number], axis);
        b = right[name];
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
        let other = loaded[left - 1u];
        var numbers = (column * block(number, other.x)) * roots[other.x];
        numbers += select(vec3f(0.0), unit(axis), is_row && left - 1u == own);
        switch other.y {
            case 1u: {
                r_7 = vec4f(r_6.w, r_7.xyz);
                r_6 = vec4f(r_5.w, r_6.xyz);
                r_5 = vec4f(r_4.w, r_5.xyz);
                r_4 = vec4f(r_3.w, r_4.xyz);
                r_3 = vec4f(r_2.w, r_3.xyz);
                r_2 = vec4f(r_1.w, r_2.xyz);
                r_1 = vec4f(r_0.w, r_1.xyz);
                r_0 = vec4f(numbers.x, r_0.xyz);
            }
            case 2u: {
                r_7 = vec4f(r_6.zw, r_7.xy);
                r_6 = vec4f(r_5.zw, r_6.xy);
                r_5 = vec4f(r_4.zw, r_5.xy);
                r_4 = vec4f(r_3.zw, r_4.xy);
                r_3 = vec4f(r_2.zw, r_3.xy);
                r_2 = vec4f(r_1.zw, r_2.xy);
                r_1 = vec4f(r_0.zw, r_1.xy);
                r_0 = vec4f(numbers.xy, r_0.xy);
            }
            default: {
                r_7 = vec4f(r_6.yzw, r_7.x);
                r_6 = vec4f(r_5.yzw, r_6.x);
                r_5 = vec4f(r_4.yzw, r_5.x);
                r_4 = vec4f(r_3.yzw, r_4.x);
                r_3 = vec4f(r_2.yzw, r_3.x);
                r_2 = vec4f(r_1.yzw, r_2.x);
                r_1 = vec4f(r_0.yzw, r_1.x);
                r_0 = vec4f(numbers, r_0.x);
            }
        }
    }
    var pivot = 1.0;
    for (var step = 0u; step < rows; step++) {
        let at = (step & 1u) * (ROW + 1u);
        if thread == step {
            handed_on[at] = vec4f(r_0.yzw, r_1.x);
            handed_on[at + 1u] = vec4f(r_1.yzw, r_2.x);
            handed_on[at + 2u] = vec4f(r_2.yzw, r_3.x);
            handed_on[at + 3u] = vec4f(r_3.yzw, r_4.x);
            handed_on[at + 4u] = vec4f(r_4.yzw, r_5.x);
            handed_on[at + 5u] = vec4f(r_5.yzw, r_6.x);
            handed_on[at + 6u] = vec4f(r_6.yzw, r_7.x);
            handed_on[at + 7u] = vec4f(r_7.yzw, 0.0);
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
    if is_row {
        right[name] = b / pivot;
    }
    workgroupBarrier();
}
