#include "spillikin/io/pipeline.h"

#include <SMP/Common/vtkSMPToolsAPI.h>
#include <fmt/format.h>
#include <vtkAlgorithm.h>
#include <vtkCommand.h>
#include <vtkDataArray.h>
#include <vtkDataObject.h>
#include <vtkErrorCode.h>
#include <vtkFieldData.h>
#include <vtkInformation.h>
#include <vtkLogger.h>
#include <vtkObjectFactory.h>
#include <vtkOutputWindow.h>
#include <vtkSmartPointer.h>
#include <vtkStreamingDemandDrivenPipeline.h>

#include <cctype>
#include <cstring>
#include <new>

#include "spillikin/base/error.h"
#include "spillikin/io/convert.h"

namespace spillikin::io {
namespace {

// Keeps the first error and drops the rest of what VTK says. Readers that find a file short often only warn of it:
// "Error reading binary data".
class Messages : public vtkOutputWindow {
 public:
  static Messages* New();
  vtkTypeMacro(Messages, vtkOutputWindow) void DisplayText(const char*) override {}
  void DisplayErrorText(const char* text) override {
    if (first_error.empty()) first_error = text;
  }
  void DisplayWarningText(const char* text) override {
    if (std::strstr(text, "rror reading") != nullptr) DisplayErrorText(text);
  }
  void DisplayGenericWarningText(const char* text) override { DisplayWarningText(text); }
  void DisplayDebugText(const char*) override {}

  std::string first_error;
};
vtkStandardNewMacro(Messages)

    // VTK's messages go here while it lives. Of the whole process: readers that are not isolated take turns.
    class Capture {
 public:
  Capture() : before_(vtkOutputWindow::GetInstance()) {
    verbosity_ = vtkLogger::GetCurrentVerbosityCutoff();
    vtkLogger::SetStderrVerbosity(vtkLogger::VERBOSITY_OFF);
    vtkOutputWindow::SetInstance(messages_);
  }
  ~Capture() {
    vtkOutputWindow::SetInstance(before_);
    vtkLogger::SetStderrVerbosity(verbosity_);
  }
  Capture(const Capture&) = delete;
  Capture& operator=(const Capture&) = delete;
  const std::string& error() const { return messages_->first_error; }

 private:
  vtkNew<Messages> messages_;
  vtkSmartPointer<vtkOutputWindow> before_;
  vtkLogger::Verbosity verbosity_;
};

// "ERROR: In f.cxx, line 7\nvtkReader (0x55): text\n\n" becomes "text", on one line.
std::string essence(const std::string& message) {
  std::size_t begin = message.find("): ");
  if (begin != std::string::npos) {
    begin += 3;
  } else {
    begin = message.find('\n');
    begin = begin == std::string::npos ? 0 : begin;
  }
  std::string text;
  for (const char c : message.substr(begin)) {
    const bool blank = std::isspace(static_cast<unsigned char>(c)) != 0;
    if (!blank && std::isprint(static_cast<unsigned char>(c)) == 0) continue;
    if (!blank) text.push_back(c);
    if (blank && !text.empty() && text.back() != ' ') text.push_back(' ');
  }
  while (!text.empty() && (text.back() == ' ' || text.back() == '.'))
    text.pop_back();
  constexpr std::size_t longest = 300;
  if (text.size() > longest) text = text.substr(0, longest) + "...";
  return text;
}

[[noreturn]] void refuse(const Request& request, const std::string& what) {
  throw Error(fmt::format("cannot read '{}': {}; the file is truncated or damaged, copy or export it again",
                          request.path, what));
}

void check(const Capture& capture, const Request& request) {
  if (!capture.error().empty()) refuse(request, essence(capture.error()));
}

void check(vtkAlgorithm* reader, const Capture& capture, const Request& request) {
  check(capture, request);
  const unsigned long code = reader->GetErrorCode();
  if (code != vtkErrorCode::NoError) refuse(request, vtkErrorCode::GetStringFromErrorCode(code));
}

// Forwards VTK's progress.
class Progress {
 public:
  Progress(vtkAlgorithm* reader, const std::function<void(double)>& report) : reader_(reader), report_(report) {
    if (report_) tag_ = reader_->AddObserver(vtkCommand::ProgressEvent, this, &Progress::tell);
  }
  ~Progress() {
    if (report_) reader_->RemoveObserver(tag_);
  }
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

 private:
  void tell() { report_(reader_->GetProgress()); }

  vtkAlgorithm* reader_;
  const std::function<void(double)>& report_;
  unsigned long tag_ = 0;
};

std::vector<double> timesOf(vtkAlgorithm* reader) {
  vtkInformation* info = reader->GetOutputInformation(0);
  auto* key = vtkStreamingDemandDrivenPipeline::TIME_STEPS();
  if (info == nullptr || !info->Has(key)) return {};
  const double* steps = info->Get(key);
  return {steps, steps + info->Length(key)};
}

// A file of one step may carry its time as field data.
void takeTimeValue(vtkDataObject* data, mesh::Source& source) {
  vtkFieldData* fields = data->GetFieldData();
  if (!source.times.empty() || fields == nullptr) return;
  for (const char* name : {"TimeValue", "TIME"}) {
    vtkDataArray* array = fields->GetArray(name);
    if (array != nullptr && array->GetNumberOfTuples() == 1 && array->GetNumberOfComponents() == 1) {
      source.times = {array->GetComponent(0, 0)};
      return;
    }
  }
}

}  // namespace

void useOneThread() {
  vtk::detail::smp::vtkSMPToolsAPI::GetInstance().SetBackend("Sequential");
}

void guarded(const Request& request, const std::function<void()>& work) {
  const Capture capture;
  work();
  check(capture, request);
}

mesh::Source run(vtkAlgorithm* reader, const Request& request, const std::function<void()>& select) {
  const Capture capture;
  const Progress progress(reader, request.progress);
  mesh::Source source;
  source.name = request.path;
  try {
    reader->UpdateInformation();
    check(reader, capture, request);
    if (select) select();
    source.times = timesOf(reader);
    source.step = chooseStep(request, source.times, std::max<std::size_t>(source.times.size(), 1));
    if (request.times_only && !source.times.empty()) return source;
    if (source.times.empty()) {
      reader->Update();
    } else {
      reader->UpdateTimeStep(source.times[source.step]);
    }
    check(reader, capture, request);
    vtkDataObject* data = reader->GetOutputDataObject(0);
    if (data == nullptr) refuse(request, "nothing could be read");
    takeTimeValue(data, source);
    if (!request.times_only) append(data, source);
    check(capture, request);
  } catch (const std::bad_alloc&) {
    refuse(request, "it asks for more memory than there is");
  } catch (const std::length_error&) {
    refuse(request, "it asks for more memory than there is");
  }
  return source;
}

}  // namespace spillikin::io
