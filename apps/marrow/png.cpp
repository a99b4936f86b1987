// Encodes images as PNG by VTK.
#include "png.h"

#include <vtkImageData.h>
#include <vtkNew.h>
#include <vtkPNGWriter.h>
#include <vtkUnsignedCharArray.h>

#include <marrow/error.h>

namespace marrow::apps {

std::string png_of(vtkImageData* image) {
    vtkNew<vtkPNGWriter> writer;
    writer->SetInputData(image);
    writer->WriteToMemoryOn();
    writer->Write();
    vtkUnsignedCharArray* const png = writer->GetResult();
    if (png == nullptr || png->GetNumberOfValues() == 0) throw IoError("cannot draw: VTK made no picture");
    return {reinterpret_cast<const char*>(png->GetPointer(0)),
            static_cast<std::size_t>(png->GetNumberOfValues())};
}

}  // namespace marrow::apps
