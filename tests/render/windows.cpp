#include "windows.hpp"

#include <fcntl.h>
#include <poll.h>
#include <sys/wait.h>
#include <unistd.h>
#include <xcb/xcb.h>

#include <chrono>
#include <csignal>
#include <cstdlib>
#include <sstream>
#include <string_view>
#include <utility>

namespace fovea::tests {

bool installed(const std::string& program) {
    const char* path = std::getenv("PATH");
    std::stringstream all(path != nullptr ? path : "");
    for (std::string folder; std::getline(all, folder, ':');)
        if (::access((folder + "/" + program).c_str(), X_OK) == 0) return true;
    return false;
}

Child::Child(const std::string& command, int inherited) {
    pid_ = fork();
    if (pid_ != 0) return;
    for (int fd = 3; fd < 64; ++fd)
        if (fd != inherited) ::close(fd);
    execl("/bin/sh", "sh", "-c", ("exec " + command).c_str(), nullptr);
    _exit(127);
}
Child::Child(Child&& o) noexcept : pid_(std::exchange(o.pid_, -1)), status_(std::exchange(o.status_, std::nullopt)) {}
Child& Child::operator=(Child&& o) noexcept {
    std::swap(pid_, o.pid_);
    std::swap(status_, o.status_);
    Child end(std::move(o));
    return *this;
}
Child::~Child() {
    if (pid_ <= 0 || status_) return;
    ::kill(pid_, SIGTERM);
    wait(5);
}
void Child::signal(int number) const {
    if (pid_ > 0 && !status_) ::kill(pid_, number);
}
bool Child::running() {
    if (pid_ <= 0 || status_) return false;
    int status = 0;
    if (waitpid(pid_, &status, WNOHANG) != pid_) return true;
    status_ = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
    return false;
}
int Child::wait(double seconds) {
    const auto until = std::chrono::steady_clock::now() + std::chrono::duration<double>(seconds);
    while (running()) {
        if (std::chrono::steady_clock::now() > until) {
            ::kill(pid_, SIGKILL);
            int status = 0;
            waitpid(pid_, &status, 0);
            status_ = -1;
            break;
        }
        usleep(5'000);
    }
    return status_.value_or(-1);
}

Xvfb::Xvfb() {
    int ends[2];
    if (pipe(ends) != 0) return;
    server_ = Child("Xvfb -displayfd " + std::to_string(ends[1]) + " -screen 0 1280x800x24 -nolisten tcp >/dev/null 2>&1", ends[1]);
    ::close(ends[1]);
    std::string number;
    pollfd ready{ends[0], POLLIN, 0};
    for (char c = 0; poll(&ready, 1, 20'000) > 0 && read(ends[0], &c, 1) == 1 && c != '\n';) number += c;
    ::close(ends[0]);
    if (!number.empty()) display_ = ":" + number;
}

Weston::Weston(const std::filesystem::path& scratch, const std::string& options, const std::string& inside) {
    const auto directory = scratch / "wayland";
    std::filesystem::create_directories(directory);
    std::filesystem::permissions(directory, std::filesystem::perms::owner_all);
    const std::string runtime = "XDG_RUNTIME_DIR='" + directory.string() + "'";
    const std::string backend = inside.empty() ? " weston --no-config --backend=headless-backend.so" : " DISPLAY=" + inside + " weston --no-config --backend=x11-backend.so --shell=kiosk-shell.so --use-pixman";
    server_ = Child("env " + runtime + backend + " --socket=fovea --width=1280 --height=800 --idle-time=0 " + options + " >'" +
                    (scratch / "weston.log").string() + "' 2>&1");
    for (int i = 0; i < 2000 && server_.running(); ++i) {
        if (std::filesystem::exists(directory / "fovea")) {
            environment_ = runtime + " WAYLAND_DISPLAY=fovea";
            return;
        }
        usleep(10'000);
    }
}

Picture screenshot(const std::string& display) {
    Picture picture;
    xcb_connection_t* c = xcb_connect(display.c_str(), nullptr);
    if (xcb_connection_has_error(c) == 0) {
        const xcb_screen_t* s = xcb_setup_roots_iterator(xcb_get_setup(c)).data;
        xcb_get_image_reply_t* r =
            xcb_get_image_reply(c, xcb_get_image(c, XCB_IMAGE_FORMAT_Z_PIXMAP, s->root, 0, 0, s->width_in_pixels, s->height_in_pixels, ~0u), nullptr);
        if (r != nullptr) {
            picture.width = s->width_in_pixels;
            picture.height = s->height_in_pixels;
            const unsigned char* bgrx = xcb_get_image_data(r);
            for (int i = 0; i < picture.width * picture.height; ++i)
                for (int k = 2; k >= 0; --k) picture.rgb.push_back(bgrx[i * 4 + k]);
            std::free(r);
        }
    }
    xcb_disconnect(c);
    return picture;
}

void close_window(const std::string& display, const std::string& name) {
    xcb_connection_t* c = xcb_connect(display.c_str(), nullptr);
    if (xcb_connection_has_error(c) == 0) {
        const xcb_window_t root = xcb_setup_roots_iterator(xcb_get_setup(c)).data->root;
        const auto atom = [&](const char* text) {
            xcb_intern_atom_reply_t* r = xcb_intern_atom_reply(c, xcb_intern_atom(c, 0, static_cast<std::uint16_t>(std::string_view(text).size()), text), nullptr);
            const xcb_atom_t a = r != nullptr ? r->atom : 0;
            std::free(r);
            return a;
        };
        xcb_query_tree_reply_t* tree = xcb_query_tree_reply(c, xcb_query_tree(c, root), nullptr);
        for (int i = 0; tree != nullptr && i < xcb_query_tree_children_length(tree); ++i) {
            const xcb_window_t window = xcb_query_tree_children(tree)[i];
            xcb_get_property_reply_t* title = xcb_get_property_reply(c, xcb_get_property(c, 0, window, XCB_ATOM_WM_NAME, XCB_ATOM_STRING, 0, 64), nullptr);
            const bool wanted = title != nullptr && std::string_view(static_cast<const char*>(xcb_get_property_value(title)),
                                                                     static_cast<std::size_t>(xcb_get_property_value_length(title))) == name;
            std::free(title);
            if (!wanted) continue;
            xcb_client_message_event_t event{};
            event.response_type = XCB_CLIENT_MESSAGE;
            event.format = 32;
            event.window = window;
            event.type = atom("WM_PROTOCOLS");
            event.data.data32[0] = atom("WM_DELETE_WINDOW");
            xcb_send_event(c, 0, window, XCB_EVENT_MASK_NO_EVENT, reinterpret_cast<const char*>(&event));
        }
        std::free(tree);
        std::free(xcb_get_input_focus_reply(c, xcb_get_input_focus(c), nullptr));   // handled before we hang up
    }
    xcb_disconnect(c);
}

}  // namespace fovea::tests
