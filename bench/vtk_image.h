/// Converts volumes to VTK images without copying.
#pragma once

#include <vtkDoubleArray.h>
#include <vtkFloatArray.h>
#include <vtkImageData.h>
#include <vtkIntArray.h>
#include <vtkNew.h>
#include <vtkPointData.h>
#include <vtkShortArray.h>
#include <vtkSignedCharArray.h>
#include <vtkSmartPointer.h>
#include <vtkUnsignedCharArray.h>
#include <vtkUnsignedShortArray.h>

#include <marrow/volume.h>

namespace marrow::bench {

template <class Array>
vtkSmartPointer<vtkDataArray> borrow(const VolumeView& volume) {
    vtkNew<Array> array;
    using T = typename Array::ValueType;
    array->SetArray(const_cast<T*>(static_cast<const T*>(volume.data)), volume.geometry.sample_count(), 1);
    return array;
}

/// An image that borrows the samples. The volume must outlive it.
inline vtkSmartPointer<vtkImageData> vtk_image(const VolumeView& volume) {
    const Geometry& g = volume.geometry;
    vtkNew<vtkImageData> image;
    image->SetDimensions(static_cast<int>(g.dims[0]), static_cast<int>(g.dims[1]),
                         static_cast<int>(g.dims[2]));
    image->SetSpacing(g.spacing.data());
    image->SetOrigin(g.origin.data());
    const auto scalars = [&] {
        switch (volume.type) {
            case SampleType::uint8:
                return borrow<vtkUnsignedCharArray>(volume);
            case SampleType::int8:
                return borrow<vtkSignedCharArray>(volume);
            case SampleType::uint16:
                return borrow<vtkUnsignedShortArray>(volume);
            case SampleType::int16:
                return borrow<vtkShortArray>(volume);
            case SampleType::int32:
                return borrow<vtkIntArray>(volume);
            case SampleType::float32:
                return borrow<vtkFloatArray>(volume);
            case SampleType::float64:
                break;
        }
        return borrow<vtkDoubleArray>(volume);
    }();
    image->GetPointData()->SetScalars(scalars);
    return image;
}

}  // namespace marrow::bench
