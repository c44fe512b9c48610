// libcamera has no C interface: this is one, and nothing else.
#include "host/camera/libcamera_shim.h"

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdio>
#include <cstring>
#include <deque>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include <libcamera/libcamera.h>
#include <libcamera/logging.h>
#include <sys/mman.h>

using namespace libcamera;

struct weft_libcamera {
    std::unique_ptr<CameraManager> manager;
    std::shared_ptr<Camera> camera;
    std::unique_ptr<CameraConfiguration> config;
    std::unique_ptr<FrameBufferAllocator> allocator;
    std::vector<std::unique_ptr<Request>> requests;
    std::vector<std::pair<void *, size_t>> maps; // by the request's cookie
    ControlList settings{controls::controls};
    bool streaming = false;
    std::atomic<bool> gone{false};

    std::mutex mutex; // over `done`
    std::condition_variable some;
    std::deque<Request *> done;

    void onCompleted(Request *request)
    {
        if (request->status() == Request::RequestCancelled && !gone)
            return; // the stream is being stopped
        const std::lock_guard<std::mutex> lock(mutex);
        done.push_back(request);
        some.notify_one();
    }
    void onDisconnected() { gone = true; }
};

namespace
{

void say(char problem[WEFT_LIBCAMERA_TEXT], const char *what, int code)
{
    if (code < 0)
        snprintf(problem, WEFT_LIBCAMERA_TEXT, "%s: %s", what, strerror(-code));
    else
        snprintf(problem, WEFT_LIBCAMERA_TEXT, "%s", what);
}

std::string modelOf(const Camera &camera)
{
    return camera.properties().get(properties::Model).value_or("");
}

// The raw stream; a pipeline without roles (UVC) has only one.
std::unique_ptr<CameraConfiguration> makeConfiguration(Camera &camera)
{
    auto config = camera.generateConfiguration({StreamRole::Raw});
    if (!config || config->empty())
        config = camera.generateConfiguration({StreamRole::StillCapture});
    return config && !config->empty() ? std::move(config) : nullptr;
}

template <typename T> bool has(const weft_libcamera &c, const Control<T> &control)
{
    return c.camera->controls().count(&control) > 0;
}

template <typename T, typename V>
void setIfThere(weft_libcamera &c, const Control<T> &control, const V &value)
{
    if (has(c, control))
        c.settings.set(control, value);
}

void freeBuffers(weft_libcamera &c)
{
    c.requests.clear();
    for (const auto &map : c.maps)
        munmap(map.first, map.second);
    c.maps.clear();
    c.allocator.reset();
}

bool makeBuffers(weft_libcamera &c, char problem[WEFT_LIBCAMERA_TEXT])
{
    Stream *const stream = c.config->at(0).stream();
    c.allocator = std::make_unique<FrameBufferAllocator>(c.camera);
    const int n = c.allocator->allocate(stream);
    if (n <= 0) {
        say(problem, "no buffers", n);
        return false;
    }
    for (const auto &buffer : c.allocator->buffers(stream)) {
        const FrameBuffer::Plane &plane = buffer->planes()[0];
        void *const map =
            mmap(nullptr, plane.offset + plane.length, PROT_READ, MAP_SHARED, plane.fd.get(), 0);
        if (map == MAP_FAILED) {
            say(problem, "a buffer cannot be mapped", -errno);
            return false;
        }
        c.maps.emplace_back(map, plane.offset + plane.length);
        auto request = c.camera->createRequest(c.requests.size());
        if (!request || request->addBuffer(stream, buffer.get()) < 0) {
            say(problem, "no request", 0);
            return false;
        }
        c.requests.push_back(std::move(request));
    }
    return true;
}

} // namespace

void weft_libcamera_hush(void)
{
    logSetTarget(LoggingTargetNone);
}

bool weft_libcamera_list(void (*each)(void *, const char *, const char *), void *context,
                         char problem[WEFT_LIBCAMERA_TEXT])
{
    CameraManager manager;
    const int code = manager.start();
    if (code < 0) {
        say(problem, "libcamera does not start", code);
        return false;
    }
    for (const auto &camera : manager.cameras())
        each(context, camera->id().c_str(), modelOf(*camera).c_str());
    manager.stop();
    return true;
}

weft_libcamera *weft_libcamera_open(const char *id, char model[64], char problem[WEFT_LIBCAMERA_TEXT])
{
    auto c = std::make_unique<weft_libcamera>();
    c->manager = std::make_unique<CameraManager>();
    int code = c->manager->start();
    if (code < 0) {
        say(problem, "libcamera does not start", code);
        return nullptr;
    }
    c->camera = c->manager->get(id);
    if (!c->camera) {
        say(problem, "there is no such camera", 0);
        return nullptr;
    }
    code = c->camera->acquire();
    if (code < 0) {
        say(problem, code == -EBUSY ? "another program uses it; close that one" : "it cannot be acquired",
            code);
        c->camera.reset();
        return nullptr;
    }
    snprintf(model, 64, "%s", modelOf(*c->camera).c_str());
    c->camera->requestCompleted.connect(c.get(), &weft_libcamera::onCompleted);
    c->camera->disconnected.connect(c.get(), &weft_libcamera::onDisconnected);
    c->config = makeConfiguration(*c->camera);
    if (!c->config) {
        say(problem, "it has no raw stream", 0);
        weft_libcamera_close(c.release());
        return nullptr;
    }
    return c.release();
}

void weft_libcamera_close(weft_libcamera *camera)
{
    if (!camera)
        return;
    weft_libcamera_stop(camera);
    camera->camera->requestCompleted.disconnect(camera);
    camera->camera->disconnected.disconnect(camera);
    freeBuffers(*camera);
    camera->config.reset();
    camera->camera->release();
    camera->camera.reset();
    camera->manager->stop();
    delete camera;
}

bool weft_libcamera_format(const weft_libcamera *camera, int i, char name[24])
{
    const auto formats = camera->config->at(0).formats().pixelformats();
    if (i < 0 || static_cast<size_t>(i) >= formats.size())
        return false;
    snprintf(name, 24, "%s", formats[static_cast<size_t>(i)].toString().c_str());
    return true;
}

bool weft_libcamera_set_format(weft_libcamera *camera, const char *name, weft_libcamera_mode *mode,
                               char problem[WEFT_LIBCAMERA_TEXT])
{
    StreamConfiguration &stream = camera->config->at(0);
    for (const PixelFormat &format : stream.formats().pixelformats()) {
        if (format.toString() != name)
            continue;
        stream.pixelFormat = format;
        stream.size = stream.formats().range(format).max;
    }
    if (camera->config->validate() == CameraConfiguration::Invalid) {
        say(problem, "its raw stream cannot be set up", 0);
        return false;
    }
    const int code = camera->camera->configure(camera->config.get());
    if (code < 0) {
        say(problem, "its raw stream cannot be set up", code);
        return false;
    }
    snprintf(mode->format, sizeof mode->format, "%s", stream.pixelFormat.toString().c_str());
    mode->width = static_cast<int>(stream.size.width);
    mode->height = static_cast<int>(stream.size.height);
    mode->stride = static_cast<int>(stream.stride);
    freeBuffers(*camera);
    return makeBuffers(*camera, problem);
}

weft_libcamera_ranges weft_libcamera_get_ranges(const weft_libcamera *camera)
{
    weft_libcamera_ranges r{};
    const ControlInfoMap &map = camera->camera->controls();
    const auto exposure = map.find(&controls::ExposureTime), gain = map.find(&controls::AnalogueGain);
    if (exposure != map.end()) {
        r.exposure_min_s = 1e-6 * exposure->second.min().get<int32_t>();
        r.exposure_max_s = 1e-6 * exposure->second.max().get<int32_t>();
    }
    if (gain != map.end()) {
        r.gain_min = static_cast<double>(gain->second.min().get<float>());
        r.gain_max = static_cast<double>(gain->second.max().get<float>());
    }
    return r;
}

bool weft_libcamera_start(weft_libcamera *c, double exposure_s, double gain,
                          char problem[WEFT_LIBCAMERA_TEXT])
{
    const int64_t us = static_cast<int64_t>(1e6 * exposure_s + 0.5);
    const std::array<int64_t, 2> duration{us + 1000, us + 100000};
    const std::array<float, 2> neutral{1, 1};
    c->settings.clear();
    setIfThere(*c, controls::AeEnable, false);
    setIfThere(*c, controls::ExposureTime, static_cast<int32_t>(us));
    setIfThere(*c, controls::AnalogueGain, static_cast<float>(gain));
    setIfThere(*c, controls::AwbEnable, false);
    setIfThere(*c, controls::ColourGains, Span<const float, 2>(neutral));
    setIfThere(*c, controls::FrameDurationLimits, Span<const int64_t, 2>(duration));
    int code = c->camera->start(&c->settings);
    if (code < 0) {
        say(problem, "it does not start", code);
        return false;
    }
    c->streaming = true;
    for (const auto &request : c->requests) {
        request->reuse(Request::ReuseBuffers);
        request->controls().merge(c->settings);
        code = c->camera->queueRequest(request.get());
        if (code < 0) {
            say(problem, "it takes no request", code);
            return false;
        }
    }
    return true;
}

void weft_libcamera_stop(weft_libcamera *c)
{
    if (!c->streaming)
        return;
    c->camera->stop();
    c->streaming = false;
    const std::lock_guard<std::mutex> lock(c->mutex);
    c->done.clear();
}

bool weft_libcamera_next(weft_libcamera *c, int timeout_ms, weft_libcamera_frame *frame)
{
    std::unique_lock<std::mutex> lock(c->mutex);
    if (!c->some.wait_for(lock, std::chrono::milliseconds(timeout_ms), [c] { return !c->done.empty(); }))
        return false;
    Request *const request = c->done.front();
    c->done.pop_front();
    const FrameBuffer &buffer = *request->buffers().begin()->second;
    const FrameMetadata &data = buffer.metadata();
    const ControlList &reported = request->metadata();
    const auto &map = c->maps[request->cookie()];
    *frame = weft_libcamera_frame{};
    frame->bytes = static_cast<const uint8_t *>(map.first) + buffer.planes()[0].offset;
    frame->size = data.planes().empty() ? 0 : data.planes()[0].bytesused;
    frame->good = request->status() == Request::RequestComplete && data.status == FrameMetadata::FrameSuccess;
    frame->sequence = data.sequence;
    frame->timestamp_ns = static_cast<uint64_t>(
        reported.get(controls::SensorTimestamp).value_or(static_cast<int64_t>(data.timestamp)));
    frame->exposure_s = 1e-6 * reported.get(controls::ExposureTime).value_or(0);
    frame->gain = static_cast<double>(reported.get(controls::AnalogueGain).value_or(0));
    if (const auto black = reported.get(controls::SensorBlackLevels)) {
        frame->has_black = true;
        for (size_t i = 0; i < 4; i++)
            frame->black[i] = (*black)[i];
    }
    frame->request = request;
    return true;
}

bool weft_libcamera_give_back(weft_libcamera *c, const weft_libcamera_frame *frame)
{
    Request *const request = static_cast<Request *>(frame->request);
    request->reuse(Request::ReuseBuffers);
    request->controls().merge(c->settings);
    return c->camera->queueRequest(request) == 0;
}

bool weft_libcamera_is_gone(const weft_libcamera *camera)
{
    return camera->gone;
}
