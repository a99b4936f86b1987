// Reads the attributes that tell the volumes of a DICOM series apart.
#include "volume_attributes.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "file.h"
#include "tags.h"

namespace marrow::internal::io {

namespace {

using enum VolumeAttribute;

enum class Form { text, uint16, uint32, float32, float64 };
using enum Form;

// Where an attribute is found: in a functional group of a frame, perhaps in a sequence within that, or in the
// file itself if `group` is 0. The first place that has a value counts.
struct Source {
    VolumeAttribute attribute;
    DicomTag group, nested, tag;
    Form form;
};

constexpr std::array kSources = {
    Source{image_type, tag::kMrFrameType, 0, tag::kFrameType, text},
    Source{image_type, tag::kCtFrameType, 0, tag::kFrameType, text},
    Source{image_type, 0, 0, tag::kImageType, text},
    Source{complex_component, tag::kMrFrameType, 0, tag::kComplexComponent, text},
    Source{complex_component, 0, 0, tag::kComplexComponent, text},
    Source{kernel, tag::kCtReconstruction, 0, tag::kConvolutionKernel, text},
    Source{kernel, 0, 0, tag::kConvolutionKernel, text},
    Source{echo_time, tag::kMrEcho, 0, tag::kEffectiveEchoTime, float64},
    Source{echo_time, 0, 0, tag::kEchoTime, text},
    Source{echo_number, 0, 0, tag::kEchoNumbers, text},
    Source{b_value, tag::kMrDiffusion, 0, tag::kBValue, float64},
    Source{b_value, 0, 0, tag::kBValue, float64},
    Source{gradient, tag::kMrDiffusion, tag::kGradientDirections, tag::kGradientOrientation, float64},
    Source{gradient, 0, 0, tag::kGradientOrientation, float64},
    Source{temporal_position, tag::kFrameContent, 0, tag::kTemporalPositionIndex, uint32},
    Source{temporal_position, 0, 0, tag::kTemporalPositionIdentifier, text},
    Source{cardiac_phase, tag::kCardiacSynchronization, 0, tag::kCardiacPhase, float32},
    Source{trigger_time, tag::kCardiacSynchronization, 0, tag::kTriggerDelayTime, float64},
    Source{trigger_time, 0, 0, tag::kTriggerTime, text},
    Source{frame_reference_time, 0, 0, tag::kFrameReferenceTime, text},
    Source{acquisition_number, tag::kFrameContent, 0, tag::kFrameAcquisitionNumber, uint16},
    Source{acquisition_number, 0, 0, tag::kAcquisitionNumber, text},
    Source{acquisition_time, tag::kFrameContent, 0, tag::kFrameAcquisitionDateTime, text},
    Source{acquisition_time, 0, 0, tag::kAcquisitionTime, text},
    Source{instance_number, 0, 0, tag::kInstanceNumber, text}};

template <class T>
std::string joined(const std::vector<T>& numbers) {
    return fmt::format("{}", fmt::join(numbers, "\\"));
}

std::string value_in(const DicomDataSet& data_set, DicomTag tag, Form form) {
    if (form == uint16) return joined(data_set.numbers<std::uint16_t>(tag));
    if (form == uint32) return joined(data_set.numbers<std::uint32_t>(tag));
    if (form == float32) return joined(data_set.numbers<float>(tag));
    if (form == float64) return joined(data_set.numbers<double>(tag));
    return readable_text(data_set, tag, data_set);
}

std::string value_in(const DicomDataSet& groups, const Source& source) {
    std::vector<DicomDataSet> items = groups.items(source.group);
    if (!items.empty() && source.nested != 0) items = items[0].items(source.nested);
    return items.empty() ? std::string() : value_in(items[0], source.tag, source.form);
}

std::string& value_of(VolumeAttributes& values, VolumeAttribute attribute) {
    return values[static_cast<std::size_t>(attribute)];
}

// Which of a frame's dimension indices are not about the place of a slice in its stack.
std::vector<std::size_t> volume_dimensions(const DicomDataSet& data_set) {
    static constexpr std::array places = {tag::kInStackPosition, tag::kImagePosition, tag::kPlanePosition,
                                          tag::kSliceLocation};
    std::vector<std::size_t> out;
    const std::vector<DicomDataSet> dimensions = data_set.items(tag::kDimensionIndexSequence);
    for (std::size_t i = 0; i < dimensions.size(); ++i) {
        const auto pointer = dimensions[i].numbers<std::uint16_t>(tag::kDimensionIndexPointer);
        const bool known = pointer.size() == 2;
        const DicomTag tag = known ? DicomTag{pointer[0]} << 16 | pointer[1] : 0;
        if (known && std::find(places.begin(), places.end(), tag) == places.end()) out.push_back(i);
    }
    return out;
}

}  // namespace

std::vector<VolumeAttributes> read_volume_attributes(const DicomDataSet& data_set,
                                                     const std::vector<DicomDataSet>& per_frame,
                                                     const std::vector<DicomDataSet>& shared,
                                                     std::size_t frames) {
    VolumeAttributes of_file, of_shared;
    for (const Source& source : kSources) {
        if (source.group == 0)
            value_of(of_file, source.attribute) = value_in(data_set, source.tag, source.form);
        else if (!shared.empty() && value_of(of_shared, source.attribute).empty())
            value_of(of_shared, source.attribute) = value_in(shared[0], source);
    }
    for (std::size_t a = 0; a < kVolumeAttributes; ++a) {
        if (!of_shared[a].empty()) of_file[a] = of_shared[a];
    }
    // Each frame has a copy, so that a long text would fill the memory.
    constexpr std::size_t kLongest = 256;
    for (std::string& value : of_file) value.resize(std::min(value.size(), kLongest));
    std::vector<VolumeAttributes> out(frames, of_file);
    if (per_frame.empty()) return out;
    const std::vector<std::size_t> dimensions = volume_dimensions(data_set);
    for (std::size_t i = 0; i < frames; ++i) {
        VolumeAttributes own;
        for (const Source& source : kSources) {
            if (source.group != 0 && value_of(own, source.attribute).empty())
                value_of(own, source.attribute) = value_in(per_frame[i], source);
        }
        for (std::size_t a = 0; a < kVolumeAttributes; ++a) {
            if (!own[a].empty()) out[i][a] = own[a];
        }
        if (dimensions.empty()) continue;
        const std::vector<DicomDataSet> content = per_frame[i].items(tag::kFrameContent);
        if (content.empty()) continue;
        const auto all = content[0].numbers<std::uint32_t>(tag::kDimensionIndexValues);
        std::vector<std::uint32_t> some;
        for (const std::size_t d : dimensions) {
            if (d < all.size()) some.push_back(all[d]);
        }
        value_of(out[i], dimension_indices) = joined(some);
    }
    return out;
}

std::string describe_attribute(VolumeAttribute attribute, const std::string& value) {
    // What each attribute is called, and its unit.
    static constexpr std::array<std::pair<const char*, const char*>, kVolumeAttributes> names = {
        {{"image type", ""},
         {"part", ""},
         {"kernel", ""},
         {"echo time", " ms"},
         {"echo", ""},
         {"b-value", " s/mm2"},
         {"gradient direction", ""},
         {"time point", ""},
         {"cardiac phase", " %"},
         {"trigger time", " ms"},
         {"frame time", " ms"},
         {"acquisition", ""},
         {"dimension index", ""},
         {"acquisition time", ""},
         {"InstanceNumber", ""}}};
    const auto& [what, unit] = names[static_cast<std::size_t>(attribute)];
    return value.empty() ? fmt::format("no {}", what) : fmt::format("{} {}{}", what, value, unit);
}

}  // namespace marrow::internal::io
