#include "bench/peers/vtk_peer.h"

#include <fmt/format.h>
#include <vtkCallbackCommand.h>
#include <vtkCamera.h>
#include <vtkCellCenterDepthSort.h>
#include <vtkCellType.h>
#include <vtkColorTransferFunction.h>
#include <vtkDoubleArray.h>
#include <vtkIdList.h>
#include <vtkIdTypeArray.h>
#include <vtkNew.h>
#include <vtkPiecewiseFunction.h>
#include <vtkPointData.h>
#include <vtkPoints.h>
#include <vtkProjectedTetrahedraMapper.h>
#include <vtkRenderWindow.h>
#include <vtkRenderer.h>
#include <vtkSmartPointer.h>
#include <vtkUnsignedCharArray.h>
#include <vtkUnstructuredGrid.h>
#include <vtkUnstructuredGridLinearRayIntegrator.h>
#include <vtkUnstructuredGridPreIntegration.h>
#include <vtkUnstructuredGridVolumeRayCastMapper.h>
#include <vtkUnstructuredGridVolumeZSweepMapper.h>
#include <vtkVersion.h>
#include <vtkVolume.h>
#include <vtkVolumeProperty.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>

#include "spillikin/base/error.h"

namespace spillikin::bench {

namespace {

using Clock = std::chrono::steady_clock;

void place(vtkCamera* camera, const View& view) {
  camera->SetPosition(view.eye.x, view.eye.y, view.eye.z);
  camera->SetFocalPoint(view.target.x, view.target.y, view.target.z);
  camera->SetViewUp(view.up.x, view.up.y, view.up.z);
  camera->SetViewAngle(view.view_angle);
  camera->SetParallelProjection(view.parallel() ? 1 : 0);
  if (view.parallel()) camera->SetParallelScale(view.parallel_scale);
}

// The values at which the transfer function is handed over, ascending, and the side taken at a jump.
struct Sample {
  double value = 0.0;
  integrate::Optical optical;
};

std::vector<Sample> samples(const integrate::TransferFunction& look) {
  constexpr int equally_spaced = 256;
  constexpr double jump_width = 1e-7;  // of the range: VTK's functions need distinct values
  const auto& points = look.points();
  const double lo = points.front().value;
  const double hi = points.back().value;
  std::vector<Sample> all;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const bool jump = i > 0 && points[i].value == points[i - 1].value;
    all.push_back({points[i].value + (jump ? jump_width * (hi - lo) : 0.0), {points[i].color, points[i].extinction}});
  }
  for (int i = 0; i < equally_spaced; ++i) {
    const double value = lo + (hi - lo) * (i + 0.5) / equally_spaced;
    all.push_back({value, look(value)});
  }
  std::stable_sort(all.begin(), all.end(), [](const Sample& a, const Sample& b) { return a.value < b.value; });
  return all;
}

void dress(vtkVolumeProperty* property, const integrate::TransferFunction& look) {
  double densest = 0.0;
  for (const auto& p : look.points())
    densest = std::max(densest, p.extinction);
  const double unit = densest > 0.0 ? 1.0 / densest : 1.0;
  vtkNew<vtkColorTransferFunction> color;
  vtkNew<vtkPiecewiseFunction> opacity;
  for (const Sample& s : samples(look)) {
    color->AddRGBPoint(s.value, s.optical.color[0], s.optical.color[1], s.optical.color[2]);
    opacity->AddPoint(s.value, s.optical.extinction * unit);
  }
  property->SetColor(color);
  property->SetScalarOpacity(opacity);
  property->SetScalarOpacityUnitDistance(unit);
  property->SetInterpolationTypeToLinear();
  property->ShadeOff();
}

template <class RayMapper>
void sampleEveryPixel(RayMapper* mapper) {
  mapper->AutoAdjustSampleDistancesOff();
  mapper->SetImageSampleDistance(1.0F);
}

vtkSmartPointer<vtkUnstructuredGridVolumeMapper> make(Mapper kind) {
  if (kind == Mapper::projected_tetrahedra)
    return vtkSmartPointer<vtkUnstructuredGridVolumeMapper>(vtkSmartPointer<vtkProjectedTetrahedraMapper>::New());
  if (kind == Mapper::zsweep) {
    vtkNew<vtkUnstructuredGridVolumeZSweepMapper> mapper;
    sampleEveryPixel(mapper.Get());
    mapper->SetRayIntegrator(vtkNew<vtkUnstructuredGridPreIntegration>());
    return vtkSmartPointer<vtkUnstructuredGridVolumeMapper>(mapper);
  }
  vtkNew<vtkUnstructuredGridVolumeRayCastMapper> mapper;
  sampleEveryPixel(mapper.Get());
  if (kind == Mapper::bunyk_linear) {
    mapper->SetRayIntegrator(vtkNew<vtkUnstructuredGridLinearRayIntegrator>());
  } else {
    mapper->SetRayIntegrator(vtkNew<vtkUnstructuredGridPreIntegration>());
  }
  return vtkSmartPointer<vtkUnstructuredGridVolumeMapper>(mapper);
}

}  // namespace

const char* name(Mapper mapper) {
  switch (mapper) {
    case Mapper::projected_tetrahedra:
      return "projected tetrahedra";
    case Mapper::bunyk_preintegrated:
      return "Bunyk, pre-integrated";
    case Mapper::bunyk_linear:
      return "Bunyk, linear";
    case Mapper::zsweep:
      return "ZSweep";
  }
  return "?";
}

struct VtkMesh::Impl {
  vtkNew<vtkUnstructuredGrid> grid;
};

VtkMesh::VtkMesh(const mesh::Mesh& mesh, const mesh::Field& field) : impl_(std::make_unique<Impl>()) {
  if (!mesh.tetrahedral()) throw Error("VTK's mappers take tetrahedra alone; subdivide the cells first");
  if (field.association != mesh::Association::points)
    throw Error(fmt::format("VTK's mappers need a point field; '{}' belongs to the cells", field.name));
  vtkNew<vtkPoints> points;
  points->SetDataTypeToDouble();
  points->SetNumberOfPoints(static_cast<vtkIdType>(mesh.points.size()));
  vtkNew<vtkDoubleArray> scalars;
  scalars->SetName("value");
  scalars->SetNumberOfTuples(static_cast<vtkIdType>(mesh.points.size()));
  for (std::size_t i = 0; i < mesh.points.size(); ++i) {
    points->SetPoint(static_cast<vtkIdType>(i), mesh.points[i].x, mesh.points[i].y, mesh.points[i].z);
    scalars->SetValue(static_cast<vtkIdType>(i), field.values[i]);
  }
  vtkUnstructuredGrid* grid = impl_->grid;
  grid->SetPoints(points);
  grid->GetPointData()->SetScalars(scalars);
  grid->AllocateExact(static_cast<vtkIdType>(mesh.cell_count()), static_cast<vtkIdType>(mesh.cell_vertex.size()));
  for (mesh::Id c = 0; c < mesh.cell_count(); ++c) {
    const auto v = mesh.vertices(c);
    const std::array<vtkIdType, 4> ids{v[0], v[1], v[2], v[3]};
    grid->InsertNextCell(VTK_TETRA, 4, ids.data());
  }
}

VtkMesh::~VtkMesh() = default;

std::size_t VtkMesh::sortByDepth(const View& view) const {
  vtkNew<vtkCamera> camera;
  place(camera, view);
  vtkNew<vtkCellCenterDepthSort> sort;
  sort->SetInput(impl_->grid);
  sort->SetCamera(camera);
  sort->SetDirectionToBackToFront();
  sort->InitTraversal();
  std::size_t count = 0;
  while (vtkIdTypeArray* ids = sort->GetNextCells())
    count += static_cast<std::size_t>(ids->GetNumberOfTuples());
  return count;
}

struct VtkPeer::Impl {
  vtkNew<vtkRenderWindow> window;
  vtkNew<vtkRenderer> renderer;
  vtkNew<vtkVolume> volume;
  vtkNew<vtkCallbackCommand> watch;
  Clock::time_point deadline;
  bool given_up = false;
  int width, height;

  static void look(vtkObject* caller, unsigned long /*event*/, void* self, void* /*data*/) {
    auto* impl = static_cast<Impl*>(self);
    if (Clock::now() < impl->deadline) return;
    impl->given_up = true;
    static_cast<vtkRenderWindow*>(caller)->SetAbortRender(1);
  }
};

VtkPeer::VtkPeer(Mapper kind, const VtkMesh& mesh, const integrate::TransferFunction& look, int width, int height)
    : impl_(std::make_unique<Impl>()) {
  impl_->width = width;
  impl_->height = height;
  const auto mapper = make(kind);
  mapper->SetInputData(mesh.impl().grid);
  dress(impl_->volume->GetProperty(), look);
  impl_->volume->SetMapper(mapper);
  impl_->renderer->SetBackground(0.0, 0.0, 0.0);
  impl_->renderer->AddVolume(impl_->volume);
  impl_->window->SetMultiSamples(0);
  impl_->window->SetOffScreenRendering(1);
  impl_->window->SetDesiredUpdateRate(1e-4);
  impl_->window->AddRenderer(impl_->renderer);
  impl_->window->SetSize(width, height);
  impl_->watch->SetCallback(&Impl::look);
  impl_->watch->SetClientData(impl_.get());
  impl_->window->AddObserver(vtkCommand::AbortCheckEvent, impl_->watch);
}

VtkPeer::~VtkPeer() = default;

bool VtkPeer::draw(const View& view, double limit_seconds) {
  impl_->deadline =
      Clock::now() + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(limit_seconds));
  impl_->given_up = false;
  place(impl_->renderer->GetActiveCamera(), view);
  impl_->renderer->ResetCameraClippingRange();
  impl_->window->Render();
  impl_->window->WaitForCompletion();
  return !impl_->given_up;
}

Image VtkPeer::image() const {
  vtkNew<vtkUnsignedCharArray> bytes;
  impl_->window->GetPixelData(0, 0, impl_->width - 1, impl_->height - 1, 0, bytes);
  Image image(impl_->width, impl_->height);
  for (int y = 0; y < image.height; ++y) {
    for (int x = 0; x < image.width; ++x) {
      const vtkIdType at = static_cast<vtkIdType>(image.height - 1 - y) * image.width + x;
      for (int k = 0; k < 3; ++k)
        image.pixel(x, y)[k] = static_cast<float>(bytes->GetTypedComponent(at, k)) / 255.0F;
    }
  }
  return image;
}

std::string vtkVersion() {
  return ::vtkVersion::GetVTKVersion();
}

}  // namespace spillikin::bench
