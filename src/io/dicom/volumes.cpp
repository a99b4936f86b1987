// Divides the slices of a DICOM series into volumes.
#include "volumes.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <map>
#include <optional>

#include "io/bytes/text.h"

namespace marrow::internal::io {

namespace {

struct PlacedSlice {
    const DicomSlice* slice;
    std::size_t position;  // index of its position in the stack

    const std::string& value(VolumeAttribute attribute) const {
        return slice->frame().volume[static_cast<std::size_t>(attribute)];
    }
};

// Slices in the order of their positions, and what tells them from others.
struct Group {
    std::vector<PlacedSlice> slices;
    std::string difference;
    std::optional<VolumeAttribute> order;  // if only the order of its values tells them apart
};

std::size_t positions_of(const Group& group) {
    std::size_t count = 0;
    for (std::size_t i = 0; i < group.slices.size(); ++i)
        count += i == 0 || group.slices[i].position != group.slices[i - 1].position;
    return count;
}

// Values in the order of numbers, if they are numbers.
struct ValueLess {
    bool operator()(const std::string& a, const std::string& b) const {
        const auto x = parse_double(a), y = parse_double(b);
        if (x && y && *x != *y) return *x < *y;
        if (x.has_value() != y.has_value()) return y.has_value();
        return a < b;
    }
};

// The parts of an ImageType that not all types have: of ORIGINAL\PRIMARY\M\ND and ORIGINAL\PRIMARY\P\ND, M
// and P.
std::string own_parts(const std::string& type, const std::vector<const std::string*>& all) {
    std::string out;
    for (const std::string_view part : values_of(type)) {
        const bool common = std::all_of(all.begin(), all.end(), [&](const std::string* other) {
            const auto parts = values_of(*other);
            return std::find(parts.begin(), parts.end(), part) != parts.end();
        });
        if (!common) out.append(out.empty() ? "" : "\\").append(part);
    }
    return out.empty() ? type : out;
}

// Divides a group by value; one group if the values do not tell volumes apart.
std::vector<Group> by_value(const Group& group, VolumeAttribute attribute) {
    std::map<std::string, Group, ValueLess> groups;
    bool differ = false;
    for (std::size_t i = 0; i < group.slices.size(); ++i) {
        const PlacedSlice& slice = group.slices[i];
        groups[slice.value(attribute)].slices.push_back(slice);
        differ |= i > 0 && group.slices[i - 1].position == slice.position &&
                  group.slices[i - 1].value(attribute) != slice.value(attribute);
    }
    // Each has half of the positions, and more than one.
    const std::size_t least = std::max<std::size_t>(2, (positions_of(group) + 1) / 2);
    const bool all_large = std::all_of(
        groups.begin(), groups.end(), [&](const auto& entry) { return positions_of(entry.second) >= least; });
    if (!differ || !all_large) return {group};
    std::vector<const std::string*> values;
    for (const auto& entry : groups) values.push_back(&entry.first);
    std::vector<Group> out;
    for (auto& [value, part] : groups) {
        part.difference = describe_attribute(
            attribute, attribute == VolumeAttribute::image_type ? own_parts(value, values) : value);
        out.push_back(std::move(part));
    }
    return out;
}

// Divides a group by the order of its values at each position; one group if that does not tell volumes apart.
std::vector<Group> by_order(const Group& group, VolumeAttribute attribute) {
    const std::size_t positions = positions_of(group), count = group.slices.size() / positions;
    if (count < 2 || group.slices.size() != count * positions) return {group};
    std::vector<Group> out(count);
    std::vector<std::array<std::string, 2>> ranges(count);  // the least and the greatest value of each
    for (std::size_t p = 0; p < positions; ++p) {
        const auto begin = group.slices.begin() + static_cast<std::ptrdiff_t>(p * count);
        std::map<std::string, PlacedSlice, ValueLess> sorted;
        for (auto at = begin; at != begin + static_cast<std::ptrdiff_t>(count); ++at) {
            if (at->position != begin->position || !parse_double(at->value(attribute))) return {group};
            sorted.emplace(at->value(attribute), *at);
        }
        if (sorted.size() != count) return {group};
        std::size_t rank = 0;
        for (const auto& [value, slice] : sorted) {
            auto& [least, greatest] = ranges[rank];
            if (p == 0 || ValueLess()(value, least)) least = value;
            if (p == 0 || ValueLess()(greatest, value)) greatest = value;
            out[rank++].slices.push_back(slice);
        }
    }
    // Instances are numbered one volume after the other.
    for (std::size_t v = 1; v < count && attribute == VolumeAttribute::instance_number; ++v) {
        if (!ValueLess()(ranges[v - 1][1], ranges[v][0])) return {group};
    }
    for (std::size_t v = 0; v < count; ++v) {
        out[v].difference =
            describe_attribute(attribute, fmt::format("{} to {}", ranges[v][0], ranges[v][1]));
        out[v].order = attribute;
    }
    return out;
}

bool has_order(VolumeAttribute attribute) {
    return attribute == VolumeAttribute::trigger_time || attribute == VolumeAttribute::acquisition_time ||
           attribute == VolumeAttribute::instance_number;
}

// Divides a group by the attributes from `first` on until each position has one slice.
void divide(Group group, std::size_t first, std::vector<Group>& out) {
    if (positions_of(group) < group.slices.size()) {
        for (std::size_t a = first; a < kVolumeAttributes; ++a) {
            const auto attribute = static_cast<VolumeAttribute>(a);
            std::vector<Group> parts = by_value(group, attribute);
            if (parts.size() == 1 && has_order(attribute)) parts = by_order(group, attribute);
            if (parts.size() == 1) continue;
            for (Group& part : parts) {
                if (!group.difference.empty()) part.difference = group.difference + ", " + part.difference;
                divide(std::move(part), a + 1, out);
            }
            return;
        }
    }
    out.push_back(std::move(group));
}

}  // namespace

std::vector<DicomStack> divide_into_volumes(DicomStack stack) {
    Group all;
    const std::vector<std::vector<std::size_t>> coincident = coincident_slices(stack);
    if (coincident.empty()) return {std::move(stack)};
    std::size_t position = 0, group = 0;
    for (std::size_t i = 0; i < stack.slices.size(); ++i) {
        if (group < coincident.size() && i > coincident[group].back()) ++group;
        const bool again =
            group < coincident.size() && i > coincident[group].front() && i <= coincident[group].back();
        if (i > 0 && !again) ++position;
        all.slices.push_back({&stack.slices[i], position});
    }
    if (position == 0) return {std::move(stack)};  // a single position is not a volume
    std::vector<Group> groups;
    divide(std::move(all), 0, groups);
    if (groups.size() == 1) return {std::move(stack)};
    std::vector<DicomStack> out;
    for (const Group& volume : groups) {
        DicomStack& one = out.emplace_back(DicomStack{stack.id, {}, volume.difference, volume.order});
        for (const PlacedSlice& placed : volume.slices) one.slices.push_back(*placed.slice);
    }
    return out;
}

}  // namespace marrow::internal::io
