/// The tags of the DICOM elements that are read.
#pragma once

#include "data_set.h"

namespace marrow::internal::io::tag {

inline constexpr DicomTag kTransferSyntaxUid = 0x00020010;
inline constexpr DicomTag kDirectoryRecords = 0x00041220;
inline constexpr DicomTag kSpecificCharacterSet = 0x00080005;
inline constexpr DicomTag kImageType = 0x00080008;
inline constexpr DicomTag kSopClassUid = 0x00080016;
inline constexpr DicomTag kSopInstanceUid = 0x00080018;
inline constexpr DicomTag kSeriesDate = 0x00080021;
inline constexpr DicomTag kAcquisitionTime = 0x00080032;
inline constexpr DicomTag kModality = 0x00080060;
inline constexpr DicomTag kCodeValue = 0x00080100;
inline constexpr DicomTag kSeriesDescription = 0x0008103e;
inline constexpr DicomTag kFrameType = 0x00089007;
inline constexpr DicomTag kComplexComponent = 0x00089208;
inline constexpr DicomTag kPatientName = 0x00100010;
inline constexpr DicomTag kSliceThickness = 0x00180050;
inline constexpr DicomTag kEchoTime = 0x00180081;
inline constexpr DicomTag kEchoNumbers = 0x00180086;
inline constexpr DicomTag kSpacingBetweenSlices = 0x00180088;
inline constexpr DicomTag kTriggerTime = 0x00181060;
inline constexpr DicomTag kConvolutionKernel = 0x00181210;
inline constexpr DicomTag kFrameAcquisitionDateTime = 0x00189074;
inline constexpr DicomTag kGradientDirections = 0x00189076;
inline constexpr DicomTag kEffectiveEchoTime = 0x00189082;
inline constexpr DicomTag kBValue = 0x00189087;
inline constexpr DicomTag kGradientOrientation = 0x00189089;
inline constexpr DicomTag kMrEcho = 0x00189114;
inline constexpr DicomTag kMrDiffusion = 0x00189117;
inline constexpr DicomTag kCardiacSynchronization = 0x00189118;
inline constexpr DicomTag kMrFrameType = 0x00189226;
inline constexpr DicomTag kCtReconstruction = 0x00189314;
inline constexpr DicomTag kCtFrameType = 0x00189329;
inline constexpr DicomTag kSeriesInstanceUid = 0x0020000e;
inline constexpr DicomTag kSeriesNumber = 0x00200011;
inline constexpr DicomTag kAcquisitionNumber = 0x00200012;
inline constexpr DicomTag kInstanceNumber = 0x00200013;
inline constexpr DicomTag kImagePosition = 0x00200032;
inline constexpr DicomTag kImageOrientation = 0x00200037;
inline constexpr DicomTag kFrameOfReferenceUid = 0x00200052;
inline constexpr DicomTag kTemporalPositionIdentifier = 0x00200100;
inline constexpr DicomTag kSliceLocation = 0x00201041;
inline constexpr DicomTag kInStackPosition = 0x00209057;
inline constexpr DicomTag kFrameContent = 0x00209111;
inline constexpr DicomTag kPlanePosition = 0x00209113;
inline constexpr DicomTag kPlaneOrientation = 0x00209116;
inline constexpr DicomTag kTemporalPositionIndex = 0x00209128;
inline constexpr DicomTag kTriggerDelayTime = 0x00209153;
inline constexpr DicomTag kFrameAcquisitionNumber = 0x00209156;
inline constexpr DicomTag kDimensionIndexValues = 0x00209157;
inline constexpr DicomTag kDimensionIndexPointer = 0x00209165;
inline constexpr DicomTag kDimensionIndexSequence = 0x00209222;
inline constexpr DicomTag kCardiacPhase = 0x00209241;
inline constexpr DicomTag kSamplesPerPixel = 0x00280002;
inline constexpr DicomTag kPhotometricInterpretation = 0x00280004;
inline constexpr DicomTag kNumberOfFrames = 0x00280008;
inline constexpr DicomTag kRows = 0x00280010;
inline constexpr DicomTag kColumns = 0x00280011;
inline constexpr DicomTag kPixelSpacing = 0x00280030;
inline constexpr DicomTag kBitsAllocated = 0x00280100;
inline constexpr DicomTag kBitsStored = 0x00280101;
inline constexpr DicomTag kHighBit = 0x00280102;
inline constexpr DicomTag kPixelRepresentation = 0x00280103;
inline constexpr DicomTag kPixelPaddingValue = 0x00280120;
inline constexpr DicomTag kRescaleIntercept = 0x00281052;
inline constexpr DicomTag kRescaleSlope = 0x00281053;
inline constexpr DicomTag kRescaleType = 0x00281054;
inline constexpr DicomTag kModalityLookupTable = 0x00283000;
inline constexpr DicomTag kPixelMeasures = 0x00289110;
inline constexpr DicomTag kPixelValueTransformation = 0x00289145;
inline constexpr DicomTag kMeasurementUnits = 0x004008ea;
inline constexpr DicomTag kEncapsulatedDocument = 0x00420011;
inline constexpr DicomTag kMimeType = 0x00420012;
inline constexpr DicomTag kFrameReferenceTime = 0x00541300;
inline constexpr DicomTag kSegmentationType = 0x00620001;
inline constexpr DicomTag kSegmentSequence = 0x00620002;
inline constexpr DicomTag kSegmentNumber = 0x00620004;
inline constexpr DicomTag kSegmentLabel = 0x00620005;
inline constexpr DicomTag kSegmentIdentification = 0x0062000a;
inline constexpr DicomTag kReferencedSegmentNumber = 0x0062000b;
inline constexpr DicomTag kRecommendedColour = 0x0062000d;
inline constexpr DicomTag kLargestFraction = 0x0062000e;
inline constexpr DicomTag kGridFrameOffsets = 0x3004000c;
inline constexpr DicomTag kDoseGridScaling = 0x3004000e;
inline constexpr DicomTag kSharedFunctionalGroups = 0x52009229;
inline constexpr DicomTag kPerFrameFunctionalGroups = 0x52009230;
inline constexpr DicomTag kFloatPixelData = 0x7fe00008;
inline constexpr DicomTag kDoublePixelData = 0x7fe00009;
inline constexpr DicomTag kPixelData = 0x7fe00010;

}  // namespace marrow::internal::io::tag
