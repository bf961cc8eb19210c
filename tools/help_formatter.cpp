#include "help_formatter.hpp"

#include <sstream>
#include <string>
#include <utility>

#include <CLI/CLI.hpp>

#include "text.hpp"

namespace gdfmap::cli {
namespace {

constexpr std::size_t kPageWidth = 80;
constexpr std::size_t kLeftColumn = 24;

class HelpFormatter : public CLI::Formatter {
 public:
  HelpFormatter() {
    column_width(kLeftColumn);
    label("OPTIONS", "options");
  }
  std::string make_help(const CLI::App* app, std::string name,
                        CLI::AppFormatMode mode) const override;
  std::string make_description(const CLI::App* app) const override;
  std::string make_subcommand(const CLI::App* app) const override;
  std::string make_option_opts(const CLI::Option* option) const override;
  std::string make_option_desc(const CLI::Option* option) const override;
};

std::string HelpFormatter::make_help(const CLI::App* app, std::string name,
                                     CLI::AppFormatMode mode) const {
  // CLI11 separates groups of options by two empty lines.
  return CLI::detail::find_and_replace(Formatter::make_help(app, std::move(name), mode), "\n\n\n",
                                       "\n\n");
}

std::string HelpFormatter::make_description(const CLI::App* app) const {
  return wrapped(app->get_description(), kPageWidth) + "\n\n";
}

std::string HelpFormatter::make_subcommand(const CLI::App* app) const {
  const std::string text = app->get_description();
  std::stringstream out;
  CLI::detail::format_help(out, app->get_name(), text.substr(0, text.find('\n')), kLeftColumn);
  return out.str();
}

std::string HelpFormatter::make_option_opts(const CLI::Option* option) const {
  const std::string value = option->get_option_text();
  return value.empty() ? "" : " " + value;
}

std::string HelpFormatter::make_option_desc(const CLI::Option* option) const {
  return wrapped(option->get_description(), kPageWidth - kLeftColumn);
}

}  // namespace

std::shared_ptr<CLI::FormatterBase> make_help_formatter() {
  return std::make_shared<HelpFormatter>();
}

}  // namespace gdfmap::cli
