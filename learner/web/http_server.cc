#include "learner/web/http_server.h"

#include <fcntl.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <ctime>
#include <deque>
#include <optional>
#include <set>
#include <utility>

#include "common/base/config_error.h"
#include "learner/web/http_text.h"

namespace treeroll::web {
namespace asio = boost::asio;
using asio::ip::tcp;
using boost::system::error_code;

namespace {

/// A socket holds so much of a response for a browser that does not read; the rest waits here, in
/// a text that browsers share.
constexpr int kSendBufferBytes = 128 * 1024;
constexpr int kBacklog = 128;
constexpr int kAcceptedAtOnce = 16;
constexpr Duration kLookPeriod = std::chrono::milliseconds(500);
/// What the loop does around each call of ours.
constexpr Duration kUncounted = std::chrono::microseconds(10);

Duration thread_time() {
  timespec time{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return std::chrono::seconds(time.tv_sec) + std::chrono::nanoseconds(time.tv_nsec);
}

}  // namespace

/// One browser's connection: reads a request, writes its response, reads the next.
struct Connection {
  explicit Connection(tcp::socket opened, TimePoint now)
      : socket(std::move(opened)), active_at(now), deadline(now) {}

  tcp::socket socket;
  TimePoint active_at;  ///< last accepted, read from or written to
  TimePoint deadline;
  std::string input;  ///< of requests that are not read yet
  bool keeps_alive = false;
  std::string head;  ///< of the response that is being written
  std::shared_ptr<const std::string> body;
  TimePoint begun_at;
  std::size_t written = 0;
  bool is_writing = false;
};

struct HttpServer::Implementation {
  Implementation(transport::Loop& daemons_loop, HttpAccess who, HttpHandler what, HttpLimits most)
      : loop(daemons_loop),
        access(std::move(who)),
        handler(std::move(what)),
        limits(most),
        share(most.thread),
        acceptor(loop.context()) {}

  ~Implementation() {
    *is_there = false;
    for (const auto& connection : connections) close(*connection);
  }

  /// Does it when its turn comes, and counts what it takes. All that a connection makes us do goes
  /// through here.
  void in_turn(std::function<void()> work) {
    turns.push_back(std::move(work));
    take_turns();
  }

  void take_turns() {
    if (is_in_turn) return;
    is_in_turn = true;
    while (!turns.empty()) {
      const TimePoint next = share.next(loop.now());
      if (next > loop.now()) {
        turn_timer.set(next);
        break;
      }
      const std::function<void()> work = std::move(turns.front());
      turns.pop_front();
      const Duration before = thread_time();
      work();
      share.use(loop.now(), thread_time() - before + kUncounted);
    }
    is_in_turn = false;
  }

  /// Once the socket is ready for it.
  template <class Socket>
  void wait(Socket& socket, typename Socket::wait_type what, std::function<void()> work) {
    socket.async_wait(what, [this, alive = is_there, work = std::move(work)](error_code error) {
      if (*alive && !error) in_turn(work);
    });
  }

  void listen() {
    wait(acceptor, tcp::acceptor::wait_read, [this] { accept(); });
  }

  void accept() {
    for (int i = 0; i < kAcceptedAtOnce; ++i) {
      error_code error;
      tcp::socket socket = acceptor.accept(error);
      if (error == asio::error::would_block) break;
      if (error == asio::error::connection_aborted) continue;
      if (error) {  // no descriptors are left, say
        accept_timer.set(loop.now() + std::chrono::seconds(1));
        return;
      }
      add(std::move(socket));
    }
    listen();
  }

  void add(tcp::socket socket) {
    if (connections.size() >= limits.connections_max) end(*longest_idle());
    auto connection = std::make_shared<Connection>(std::move(socket), loop.now());
    fcntl(connection->socket.native_handle(), F_SETFD, FD_CLOEXEC);
    error_code ignored;
    connection->socket.non_blocking(true, ignored);
    connection->socket.set_option(tcp::no_delay(true), ignored);
    connection->socket.set_option(asio::socket_base::send_buffer_size(kSendBufferBytes), ignored);
    connections.insert(connection);
    expect_request(connection);
    if (!look_timer.is_set()) look_timer.set(loop.now() + kLookPeriod);
  }

  std::shared_ptr<Connection> longest_idle() const {
    return *std::min_element(
        connections.begin(), connections.end(),
        [](const auto& a, const auto& b) { return a->active_at < b->active_at; });
  }

  static void close(Connection& connection) {
    error_code ignored;
    connection.socket.close(ignored);
  }

  void end(Connection& connection) {
    close(connection);
    std::erase_if(connections, [&](const auto& each) { return each.get() == &connection; });
  }

  void look_at_deadlines() {
    const TimePoint now = loop.now();
    std::vector<std::shared_ptr<Connection>> late;
    for (const auto& connection : connections) {
      if (connection->deadline <= now) late.push_back(connection);
    }
    for (const auto& connection : late) end(*connection);
    if (!connections.empty()) look_timer.set(now + kLookPeriod);
  }

  void expect_request(const std::shared_ptr<Connection>& connection) {
    connection->is_writing = false;
    connection->deadline = loop.now() + limits.idle;
    if (!connection->input.empty()) return in_turn([this, connection] { parse(connection); });
    await_bytes(connection);
  }

  void await_bytes(const std::shared_ptr<Connection>& connection) {
    wait(connection->socket, tcp::socket::wait_read, [this, connection] { read(connection); });
  }

  void read(const std::shared_ptr<Connection>& connection) {
    if (!connection->socket.is_open()) return;
    std::array<char, 4096> bytes;
    error_code error;
    const std::size_t size = connection->socket.read_some(asio::buffer(bytes), error);
    if (error == asio::error::would_block) return await_bytes(connection);
    if (error) return end(*connection);
    connection->active_at = loop.now();
    if (connection->input.empty()) connection->deadline = loop.now() + limits.request;
    connection->input.append(bytes.data(), size);
    parse(connection);
  }

  void parse(const std::shared_ptr<Connection>& connection) {
    if (!connection->socket.is_open()) return;
    ReadRequest read = read_request(connection->input, limits.request_bytes_max);
    if (std::holds_alternative<RequestIsNotWhole>(read)) return await_bytes(connection);
    if (const auto* refusal = std::get_if<HttpResponse>(&read)) return refuse(connection, *refusal);
    const HttpRequest& request = std::get<HttpRequest>(read);
    ++num_requests;
    connection->keeps_alive = request.keeps_alive;
    respond(connection, answer(request), request.is_head);
  }

  HttpResponse answer(const HttpRequest& request) const {
    if (std::optional<HttpResponse> refusal = refusal_of(access, request)) return *refusal;
    try {
      HttpResponse response = handler(request);
      const auto known = request.headers.find("if-none-match");
      if (known != request.headers.end() && !response.etag.empty() &&
          known->second == response.etag) {
        response.status = 304;
        response.body = std::make_shared<const std::string>();
      }
      return response;
    } catch (const std::exception& error) {
      return plain(500, error.what());
    }
  }

  /// And hangs up: what follows may be anything.
  void refuse(const std::shared_ptr<Connection>& connection, const HttpResponse& response) {
    connection->keeps_alive = false;
    respond(connection, response, false);
  }

  void respond(const std::shared_ptr<Connection>& connection, const HttpResponse& response,
               bool is_head) {
    connection->head = head_of(response, connection->keeps_alive);
    connection->body = is_head ? std::make_shared<const std::string>() : response.body;
    connection->written = 0;
    connection->is_writing = true;
    connection->begun_at = loop.now();
    connection->deadline = connection->begun_at + limits.response;
    write(connection);
  }

  void write(const std::shared_ptr<Connection>& connection) {
    if (!connection->socket.is_open()) return;
    const std::string& head = connection->head;
    const std::string& body = *connection->body;
    while (connection->written < head.size() + body.size()) {
      const std::size_t of_head = std::min(connection->written, head.size());
      const std::size_t of_body = connection->written - of_head;
      const std::array<asio::const_buffer, 2> left = {
          asio::buffer(head.data() + of_head, head.size() - of_head),
          asio::buffer(body.data() + of_body, body.size() - of_body)};
      error_code error;
      const std::size_t size = connection->socket.write_some(left, error);
      if (error == asio::error::would_block) {
        return wait(connection->socket, tcp::socket::wait_write,
                    [this, connection] { write(connection); });
      }
      if (error) return end(*connection);
      connection->written += size;
      connection->active_at = loop.now();
      connection->deadline = std::min(connection->active_at + limits.response,
                                      connection->begun_at + limits.response_in_all);
    }
    connection->body.reset();
    if (!connection->keeps_alive) return hang_up(connection);
    expect_request(connection);
  }

  /// What it still sends is read and thrown away for a while, or the response would be lost with a
  /// reset.
  void hang_up(const std::shared_ptr<Connection>& connection) {
    error_code ignored;
    connection->socket.shutdown(tcp::socket::shutdown_send, ignored);
    connection->deadline = std::min(connection->deadline, loop.now() + std::chrono::seconds(1));
    drain(connection);
  }

  void drain(const std::shared_ptr<Connection>& connection) {
    if (!connection->socket.is_open()) return;
    std::array<char, 4096> bytes;
    error_code error;
    connection->socket.read_some(asio::buffer(bytes), error);
    if (error && error != asio::error::would_block) return end(*connection);
    wait(connection->socket, tcp::socket::wait_read, [this, connection] { drain(connection); });
  }

  transport::Loop& loop;
  HttpAccess access;
  HttpHandler handler;
  HttpLimits limits;
  TimeShare share;
  tcp::acceptor acceptor;
  std::set<std::shared_ptr<Connection>> connections;
  std::deque<std::function<void()>> turns;  ///< at most one of each connection, and the acceptor's
  bool is_in_turn = false;
  std::int64_t num_requests = 0;
  std::shared_ptr<bool> is_there = std::make_shared<bool>(true);  ///< handlers of Asio hold it too
  transport::Timer turn_timer{loop, [this] { take_turns(); }};
  transport::Timer look_timer{loop, [this] { look_at_deadlines(); }};
  transport::Timer accept_timer{loop, [this] { listen(); }};
};

HttpServer::HttpServer(transport::Loop& loop, const std::string& option, const HttpAddress& address,
                       HttpAccess access, HttpHandler handler, HttpLimits limits)
    : implementation_(
          std::make_unique<Implementation>(loop, std::move(access), std::move(handler), limits)) {
  tcp::acceptor& acceptor = implementation_->acceptor;
  const tcp::endpoint endpoint(asio::ip::make_address(address.host), address.port);
  error_code error;
  const auto check = [&](const char* what) {
    if (!error) return;
    throw ConfigError(
        option, fmt::format("{}:{}", address.host, address.port),
        fmt::format("must be an address to listen on: {}: {}", what, error.message()));
  };
  acceptor.open(endpoint.protocol(), error);
  check("open");
  fcntl(acceptor.native_handle(), F_SETFD, FD_CLOEXEC);
  // A learner that is resumed gets the port of the one before.
  acceptor.set_option(tcp::acceptor::reuse_address(true), error);
  check("reuse");
  acceptor.bind(endpoint, error);
  check("bind");
  acceptor.listen(kBacklog, error);
  check("listen");
  acceptor.non_blocking(true, error);
  check("non-blocking");
  implementation_->listen();
}

HttpServer::~HttpServer() = default;

std::uint16_t HttpServer::port() const { return implementation_->acceptor.local_endpoint().port(); }

std::string HttpServer::url() const {
  const tcp::endpoint at = implementation_->acceptor.local_endpoint();
  const std::string host = at.address().to_string();
  return fmt::format("http://{}:{}/", at.address().is_v6() ? "[" + host + "]" : host, at.port());
}

std::size_t HttpServer::num_connections() const { return implementation_->connections.size(); }

std::int64_t HttpServer::num_requests() const { return implementation_->num_requests; }

}  // namespace treeroll::web
