// Writes the points and normals. One invocation descends the pyramid to its crossed edge and interpolates there. The
// operations are those of core/marching_cubes/emit_points.cpp, in the same order.
#include "arithmetic.glsl"
#include "grid.glsl"
#include "pyramid.glsl"
#include "samples.glsl"

const float kLeastFraction = 1.0 / 1024.0;

// An edge, by the index in the view of its first sample.
struct Edge {
    ivec3 first;
    uint axis;
};

ivec3 step_along(uint axis) {
    return ivec3(axis == 0u, axis == 1u, axis == 2u);
}
ivec3 second_of(Edge edge) {
    return edge.first + step_along(edge.axis);
}

bool in_view(ivec3 at) {
    return all(greaterThanEqual(at, ivec3(0))) &&
           all(lessThan(at, ivec3(parameters.dims[0], parameters.dims[1], parameters.dims[2])));
}

int sample_of_view(ivec3 at) {
    return sample_at(at + ivec3(parameters.lead[0], parameters.lead[1], parameters.lead[2]));
}

float fraction_of(int first_raw, int second_raw) {
    if (!is_finite(first_raw) || !is_finite(second_raw)) return 0.5;
    // The CPU halves only floats; nothing of the result depends on it.
    const float first = mul(0.5, value_of(first_raw)), second = mul(0.5, value_of(second_raw));
    const float difference = sub(second, first), rise = sub(parameters.half_isovalue, first);
    if (is_zero(rise) || exponent(rise) < exponent(difference) - 12) return kLeastFraction;
    const float t = div(rise, difference);
    return t < kLeastFraction ? kLeastFraction : t > 1.0 - kLeastFraction ? 1.0 - kLeastFraction : t;
}

vec3 position_of(Edge edge, uint row, float t) {
    const float x = float(edge.first.x + parameters.first_x);
    vec3 position;
    [[unroll]] for (uint r = 0u; r < 3u; ++r) {
        const float first = add(parameters.row_bases.at[3u * row + r], mul(parameters.matrix[3u * r], x));
        position[r] = add(first, mul(parameters.matrix[3u * r + edge.axis], t));
    }
    return position;
}

// The direction of an edge, out of the surface.
vec3 direction_of(Edge edge, bool first_inside) {
    vec3 direction;
    [[unroll]] for (uint r = 0u; r < 3u; ++r) {
        const float d = parameters.axis[3u * edge.axis + r];
        direction[r] = first_inside ? d : negated(d);
    }
    return direction;
}

// A central difference, or twice the one-sided one at the end of the stored samples. If a sample is not finite,
// `finite` becomes false and the result has no meaning.
float slope_at(ivec3 at, uint axis, inout bool finite) {
    const int i = at[axis] + parameters.lead[axis];
    const bool has_before = i > 0, has_after = i + 1 < parameters.stored[axis];
    if (!has_before && !has_after) return 0.0;
    const int before = sample_of_view(has_before ? at - step_along(axis) : at);
    const int after = sample_of_view(has_after ? at + step_along(axis) : at);
    if (!is_finite(before) || !is_finite(after)) {
        finite = false;
        return 0.0;
    }
    const float difference = sub(value_of(after), value_of(before));
    return has_before && has_after ? difference : add(difference, difference);
}

// Whether the sample after the edge, in its direction, is an infinity that slopes against the edge. Only then a
// gradient that is not finite is replaced by the edge's own slope.
bool infinite_against(Edge edge, float difference) {
    const ivec3 beyond = second_of(edge) + step_along(edge.axis);
    if (beyond[edge.axis] + parameters.lead[edge.axis] >= parameters.stored[edge.axis]) return false;
    const int raw = sample_of_view(beyond);
    const bool infinite = (raw & 0x7fffffff) == 0x7f800000;
    return kSampleType == kFloat32 && infinite && (raw < 0) != (difference < 0.0);
}

// The gradient at fraction t of an edge whose ends are finite. Returns false if it is not finite.
bool gradient_at(Edge edge, float t, float difference, out vec3 gradient) {
    const float slope = add(difference, difference);  // central differences span two samples
    [[unroll]] for (uint a = 0u; a < 3u; ++a) {
        bool finite_first = true, finite_second = true;
        const float first = slope_at(edge.first, a, finite_first);
        const float second = slope_at(second_of(edge), a, finite_second);
        if (!finite_first) return false;
        if (!finite_second) {
            if (a != edge.axis || !infinite_against(edge, difference)) return false;
            gradient[a] = slope;
            continue;
        }
        gradient[a] = add(first, mul(t, sub(second, first)));
        // Where the gradient along the edge is less than a quarter of the edge's own slope, this slope replaces it.
        if (a == edge.axis) {
            const float rise = difference < 0.0 ? negated(gradient[a]) : gradient[a];
            if (rise < mul(0.5, magnitude(difference))) gradient[a] = slope;
        }
    }
    return true;
}

// Scales gradients whose squares might overflow or underflow. Integers have none.
void scale_extreme(inout vec3 gradient) {
    const float large = 1125899906842624.0, small = 1.0 / large;  // 2^50
    const float steepest = max(max(magnitude(gradient[0]), magnitude(gradient[1])), magnitude(gradient[2]));
    if (steepest > small && steepest < large) return;
    [[unroll]] for (int a = 0; a < 3; ++a) gradient[a] = div(gradient[a], steepest);
}

vec3 normal_of(Edge edge, float t, int first_raw, int second_raw) {
    const bool first_finite = is_finite(first_raw), second_finite = is_finite(second_raw);
    const vec3 along =
        direction_of(edge, first_finite && !(second_finite && ordered(second_raw) > ordered(first_raw)));
    if (!first_finite || !second_finite) return along;
    const float difference = sub(value_of(second_raw), value_of(first_raw));
    vec3 gradient;
    if (!gradient_at(edge, t, difference, gradient)) return along;
    if (is_zero(gradient.x) && is_zero(gradient.y) && is_zero(gradient.z)) return along;
    if (kSampleType == kFloat32) scale_extreme(gradient);
    vec3 normal;
    [[unroll]] for (uint r = 0u; r < 3u; ++r) {
        const float two = add(mul(parameters.normal_matrix[3u * r], gradient[0]),
                              mul(parameters.normal_matrix[3u * r + 1u], gradient[1]));
        normal[r] = add(two, mul(parameters.normal_matrix[3u * r + 2u], gradient[2]));
    }
    const float per_length = div(1.0, square_root(sum_of_squares(normal)));
    [[unroll]] for (int r = 0; r < 3; ++r) normal[r] = mul(normal[r], per_length);
    return normal;
}

Triple bits_of(vec3 v) {
    return Triple(floatBitsToUint(v.x), floatBitsToUint(v.y), floatBitsToUint(v.z));
}

void write_point(uint point) {
    uint key = point;
    const uint leaf = descend(kPoints, key);
    const uint w = leaf % parameters.leaf_words, axis = leaf / parameters.leaf_words % 3u;
    const uint row = leaf / parameters.leaf_words / 3u;
    const int y = int(row % uint(parameters.grid_rows[0])), z = int(row / uint(parameters.grid_rows[0]));
    const int bit = find_bit(crossed_edges(axis, y, z, int(w)), key);
    const Edge edge = Edge(ivec3(x_of_word(int(w)) + bit, y - kPad, z - kPad), axis);

    // The outer end of an edge that leaves the view has no value, so the point is in the middle.
    const bool first_in_view = in_view(edge.first);
    const bool leaves = !first_in_view || !in_view(second_of(edge));
    const int first = leaves ? 0 : sample_of_view(edge.first), second = leaves ? 0 : sample_of_view(second_of(edge));
    const float t = leaves ? 0.5 : fraction_of(first, second);
    parameters.points.at[point] = bits_of(position_of(edge, row, t));
    if (kNormals)
        parameters.normals.at[point] =
            bits_of(leaves ? direction_of(edge, first_in_view) : normal_of(edge, t, first, second));
}

void main() {
    const uint points = outputs_with_room(kPoints);
    for (uint point = invocation(); point < points; point += invocations()) write_point(point);
    if (unsafe) parameters.status.at[kUnsafe] = 1u;
}
