/// Isosurfaces of image data by Marrow, in place of vtkFlyingEdges3D.
#pragma once

#include <vtkMarrowModule.h>
#include <vtkNew.h>
#include <vtkPolyDataAlgorithm.h>

class vtkContourValues;

/// Extracts isosurfaces of point scalars by marching cubes with histogram pyramids, with the methods of
/// vtkFlyingEdges3D for values, normals and scalars; ComputeGradients, InterpolateAttributes and
/// ArrayComponent are not there. The points are those of vtkFlyingEdges3D, but for the floats' last digits;
/// the triangles leave no holes and no edge that more than two of them share. NaN and infinite samples are
/// outside.
///
/// Samples are read where they are, without a copy: unsigned char, signed char, char, short, unsigned short,
/// int, float or double, of one component, in VTK's standard memory layout. Others are an error, and the
/// output is empty. Any spacing but zero, and any origin, extent and direction will do. The arrays of the
/// output are Marrow's own, also without a copy, if there is one value.
///
/// In a pipeline of pieces, as with MPI, each piece has the cells of its input that are not ghost cells, and
/// each of its points and normals has the bits of the whole surface's. Normals at a piece's border need one
/// ghost level, for which the filter asks. Where no array marks ghost cells, as behind
/// vtkImageChangeInformation, they are those of a piece as VTK splits the whole extent. A ghost array must
/// have one value for each cell. The output has no ghost cells.
///
/// Abort requests and progress are handled during the work, on the thread that called Update().
class VTKMARROW_EXPORT vtkMarrowContour : public vtkPolyDataAlgorithm {
  public:
    static vtkMarrowContour* New();
    vtkTypeMacro(vtkMarrowContour, vtkPolyDataAlgorithm);
    void PrintSelf(ostream& os, vtkIndent indent) override;
    vtkMTimeType GetMTime() override;

    /// The isovalues; samples that are greater or equal are inside.
    void SetValue(int i, double value);
    double GetValue(int i);
    double* GetValues() VTK_SIZEHINT(GetNumberOfContours());
    void GetValues(double* values);
    void SetNumberOfContours(int count);
    vtkIdType GetNumberOfContours();
    void GenerateValues(int count, double range[2]);
    void GenerateValues(int count, double low, double high);

    /// Unit normals at points, from inside to outside; on by default.
    vtkSetMacro(ComputeNormals, vtkTypeBool);
    vtkGetMacro(ComputeNormals, vtkTypeBool);
    vtkBooleanMacro(ComputeNormals, vtkTypeBool);

    /// The isovalue at each point, in an array with the name and the type of the input's, or the nearest
    /// value that this type has; on by default.
    vtkSetMacro(ComputeScalars, vtkTypeBool);
    vtkGetMacro(ComputeScalars, vtkTypeBool);
    vtkBooleanMacro(ComputeScalars, vtkTypeBool);

    /// Global ids of points, which tell equal points of different pieces: numbers of the grid edges of the
    /// whole volume on which they lie, and the same for any pieces. With exact topology, points inside cells
    /// have ids too, and those of edges are others than without it. With several isovalues, the ids of the
    /// second follow those of the first, and so on. Off by default.
    vtkSetMacro(ComputeGlobalIds, vtkTypeBool);
    vtkGetMacro(ComputeGlobalIds, vtkTypeBool);
    vtkBooleanMacro(ComputeGlobalIds, vtkTypeBool);

    /// Whether the surface is closed at the border of the whole volume, as if outside samples
    /// surrounded it; off by default.
    vtkSetMacro(Closed, vtkTypeBool);
    vtkGetMacro(Closed, vtkTypeBool);
    vtkBooleanMacro(Closed, vtkTypeBool);

    /// Whether the surface has exactly the topology of the trilinear interpolant, as docs/algorithm.md
    /// describes; off by default.
    vtkSetMacro(ExactTopology, vtkTypeBool);
    vtkGetMacro(ExactTopology, vtkTypeBool);
    vtkBooleanMacro(ExactTopology, vtkTypeBool);

    /// The threads to use; 0, the default, stands for all.
    vtkSetClampMacro(NumberOfThreads, int, 0, VTK_INT_MAX);
    vtkGetMacro(NumberOfThreads, int);

    vtkMarrowContour(const vtkMarrowContour&) = delete;
    void operator=(const vtkMarrowContour&) = delete;

  protected:
    vtkMarrowContour();
    ~vtkMarrowContour() override;

    int FillInputPortInformation(int port, vtkInformation* info) override;
    int RequestUpdateExtent(vtkInformation*, vtkInformationVector**, vtkInformationVector*) override;
    int RequestData(vtkInformation*, vtkInformationVector**, vtkInformationVector*) override;

  private:
    vtkNew<vtkContourValues> ContourValues;
    vtkTypeBool ComputeNormals = true;
    vtkTypeBool ComputeScalars = true;
    vtkTypeBool ComputeGlobalIds = false;
    vtkTypeBool Closed = false;
    vtkTypeBool ExactTopology = false;
    int NumberOfThreads = 0;
};
