#include "runtime/report/report_page.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>

#include "io/frames/vtkhdf.h"
#include "io/json/json_text.h"
#include "lahar_report_page.h"
#include "runtime/picture/quantity.h"
#include "runtime/picture/svg.h"
#include "runtime/report/html.h"
#include "runtime/report/map_picture.h"
#include "runtime/report/report_text.h"
#include "runtime/report/run_charts.h"
#include "runtime/report/safety_text.h"
#include "runtime/terminal/html_page.h"
#include "runtime/terminal/version.h"

namespace lahar {

namespace {

constexpr int map_colours = 255;

/// Pictures of the particles of a run, as HTML.
struct RunPictures {
  std::string still;  ///< in the place of the 3D view
  std::string figures;
};

class ReportPage {
 public:
  ReportPage(const std::vector<RunResults>& runs, const ReportOptions& options)
      : runs_(runs), options_(options) {
    choose_fields();
    take_samples();
    draw_pictures();
  }

  std::string fill() const {
    return fill_page(embedded::report_template, [&](std::string_view name) -> std::string {
      if (name == "title") return xml_escaped(title());
      if (name == "base style") return std::string(embedded::base_style);
      if (name == "style") return std::string(embedded::report_style);
      if (name == "head") return head();
      if (name == "body") return body();
      if (name == "foot") return xml_escaped("Written by Lahar " + version_line() + ".");
      if (name == "particles") return within_script(particles_json());
      if (name == "library") return embedded::library_script;
      if (name == "library licence") return std::string(embedded::library_licence);
      if (name == "script") return std::string(embedded::report_script);
      throw std::logic_error("report.html asks for '" + std::string(name) + "'");
    });
  }

 private:
  /// Fields that the first frame of every run has.
  void choose_fields() {
    fields_ = options_.fields;
    bool first = true;
    for (const RunResults& run : runs_) {
      const std::vector<ReportFrame> frames = frames_of(run);
      if (frames.empty()) continue;
      const FrameHeader header = read_frame_header(frames.front().file.file);
      for (const std::string& field : options_.fields) columns_of_field(header, field);
      if (!options_.fields.empty()) continue;
      const std::vector<std::string> usual = usual_fields(header), names = field_names(header);
      if (first)
        fields_ = usual;
      else
        std::erase_if(fields_, [&](const std::string& field) {
          return std::find(names.begin(), names.end(), field) == names.end();
        });
      first = false;
    }
  }

  void take_samples() {
    SampleBudget budget = options_.budget;
    budget.points /= runs_.size();
    budget.triangles /= runs_.size();
    budget.bytes /= static_cast<double>(runs_.size());
    for (const RunResults& run : runs_) {
      samples_.push_back(sample(run, fields_, budget));
      const RunSamples& own = samples_.back();
      if (own.frames.empty()) continue;
      if (scales_.empty()) {
        scales_ = own.scales;
        bounds_ = own.bounds;
        about_ = own.fields;
        continue;
      }
      for (std::size_t f = 0; f < scales_.size(); ++f)
        scales_[f] = joined(scales_[f], own.scales[f]);
      bounds_.add(own.bounds);
    }
  }

  std::string title() const {
    if (runs_.size() == 1) return runs_[0].title;
    std::string text;
    for (const RunResults& run : runs_) text += (text.empty() ? "" : ", ") + run.label;
    return text;
  }

  std::string head() const {
    std::string text;
    for (const RunResults& run : runs_) {
      if (runs_.size() > 1) text += "<h3>" + xml_escaped(run.label + ": " + run.title) + "</h3>\n";
      text += verdict(run);
      const RunPart& last = run.last();
      std::string stages;
      if (run.parts.size() > 1)
        for (const RunPart& part : run.parts) stages += (stages.empty() ? "" : ", ") + part.name;
      const auto fact = [](const std::string& name, const std::string& value) {
        return value.empty()
                   ? ""
                   : fmt::format("<div><dt>{}</dt><dd>{}</dd></div>", name, xml_escaped(value));
      };
      const std::string scheme = text_in(member_of(last.manifest, "model"), "scheme");
      text += "<dl class=\"facts\">" + fact("dimensions", quantity(last.model("dim"), "")) +
              fact("scheme", scheme) + fact(run.safety ? "runs" : "stages", stages) +
              fact("started", last.text("started")) +
              fact("folder", (run.safety ? last.folder.parent_path() : last.folder).string()) +
              "</dl>\n";
    }
    return text;
  }

  std::string body() const {
    return card("Factor of safety", safety_text(runs_)) + card("Key figures", key_figures(runs_)) +
           card("Particles", particle_views()) + card("Pictures", pictures()) +
           card("Energies and motion", charts(history_charts(runs_))) +
           card("Gauges", charts(gauge_charts(runs_))) + card("Maps", maps()) +
           card("Rigid bodies", charts(body_charts(runs_))) +
           card("Warnings", warnings_text(runs_)) + card("Time and efficiency", efficiency(runs_)) +
           card("Inputs and versions", provenance(runs_));
  }

  bool has_frames() const {
    return std::any_of(samples_.begin(), samples_.end(),
                       [](const auto& s) { return !s.frames.empty(); });
  }

  /// A place for each run: a picture, which a script replaces by the view.
  std::string particle_views() const {
    if (!has_frames()) return "";
    std::string text =
        "<p id=\"no-3d\" class=\"note\" hidden></p>\n<div class=\"tools\" id=\"player\" hidden>"
        "<button type=\"button\" id=\"play\" aria-pressed=\"false\">play</button>"
        "<input type=\"range\" id=\"frame\" min=\"0\" value=\"0\" aria-label=\"time\">"
        "<output id=\"time\"></output>"
        "<label>colour by <select id=\"field\"></select></label>"
        "<span class=\"group\" id=\"looks\"><button type=\"button\" data-look=\"3d\">3D</button>"
        "<button type=\"button\" data-look=\"top\">top</button>"
        "<button type=\"button\" data-look=\"front\">front</button>"
        "<button type=\"button\" data-look=\"side\">side</button></span>"
        "<label id=\"with-bodies\" hidden><input type=\"checkbox\" id=\"bodies\" checked> rigid "
        "bodies</label></div>\n<div "
        "class=\"runs\">\n";
    for (std::size_t r = 0; r < runs_.size(); ++r) {
      if (samples_[r].frames.empty()) continue;
      text += "<figure class=\"view\">";
      if (runs_.size() > 1) text += "<figcaption>" + xml_escaped(runs_[r].label) + "</figcaption>";
      text += fmt::format(
          "<div class=\"stage\" hidden><canvas tabindex=\"0\" aria-label=\"Particles of "
          "{}\"></canvas>"
          "<span class=\"now\"></span></div>\n<div class=\"still\">{}</div>{}</figure>\n",
          xml_escaped(runs_[r].label), pictures_[r].still, shown_text(samples_[r]));
    }
    return text +
           "</div>\n<div class=\"scale\" id=\"scale\" hidden><span id=\"scale-low\"></span>"
           "<i class=\"bar\" id=\"scale-bar\"></i><span id=\"scale-high\"></span>"
           "<span id=\"scale-unit\"></span></div>\n"
           "<p class=\"soft help\">Drag: turn. Wheel: zoom. Right button: move. Keys: arrows turn "
           "(with shift: move), + and − zoom, space plays, comma and full stop go through the "
           "frames, Home returns.</p>\n";
  }

  static std::string shown_text(const RunSamples& samples) {
    if (samples.shown >= samples.particles) return "";
    return fmt::format("<p class=\"soft help\">{} of {} particles, the same in all frames.</p>",
                       format_count(samples.shown), format_count(samples.particles));
  }

  /// A frame with what pictures of these fields need.
  Frame read(const ReportFrame& at, const std::vector<std::string>& fields) const {
    const FrameHeader header = read_frame_header(at.file.file);
    std::vector<std::string> columns;
    for (const std::string& field : fields)
      for (std::string& column : columns_of_picture(header, field))
        columns.push_back(std::move(column));
    return read_frame(at.file.file, columns);
  }

  std::string picture_of(const Frame& frame, const RunPart& part, std::size_t field, double width,
                         double height) const {
    if (frame.id.empty()) return "<p class=\"soft\">There are no particles.</p>";
    const FramePictureOptions options{.field = fields_[field],
                                      .look = look_of("", frame.dim),
                                      .scale = scales_[field],
                                      .bounds = bounds_,
                                      .title = {},
                                      .axisymmetric = part.axisymmetric,
                                      .bodies = part.shapes.at(frame.time),
                                      .ink = page_ink,
                                      .largest_width = width,
                                      .largest_height = height,
                                      .pixel_scale = 1.5};
    return svg_of(FramePicture(frame, options));
  }

  static std::string svg_of(const auto& picture) {
    Svg svg(picture.width(), picture.height(), "none");
    picture.draw(svg);
    return svg.finish();
  }

  /// The first field at some times, and all of them at the end. The last frame is read once.
  RunPictures pictures_of(const RunResults& run) const {
    RunPictures pictures;
    const auto figure = [&](const Frame& frame, const RunPart& part, std::size_t field) {
      pictures.figures += "<figure>";
      if (std::string caption = part.heading(); !part.name.empty()) {
        caption[0] = static_cast<char>(std::toupper(static_cast<unsigned char>(caption[0])));
        pictures.figures += "<figcaption>" + xml_escaped(caption) + "</figcaption>";
      }
      pictures.figures += picture_of(frame, part, field, 560, 360) + "</figure>\n";
    };
    const std::vector<ReportFrame> frames = frames_of(run);
    const ReportFrame& end = frames.back();
    for (const ReportFrame& at :
         options_.at.empty() ? spread(frames, options_.times) : nearest(frames, options_.at))
      if (at.file.file != end.file.file) figure(read(at, {fields_[0]}), *at.part, 0);
    const Frame last = read(end, fields_);
    for (std::size_t f = 0; f < fields_.size(); ++f) figure(last, *end.part, f);
    pictures.still = picture_of(last, *end.part, 0, 900, 520);
    return pictures;
  }

  void draw_pictures() {
    for (std::size_t r = 0; r < runs_.size(); ++r)
      pictures_.push_back(samples_[r].frames.empty() ? RunPictures{} : pictures_of(runs_[r]));
  }

  std::string pictures() const {
    std::string text;
    for (std::size_t r = 0; r < runs_.size(); ++r) {
      if (samples_[r].frames.empty()) continue;
      if (runs_.size() > 1) text += "<h3>" + xml_escaped(runs_[r].label) + "</h3>\n";
      text += "<div class=\"grid\">\n" + pictures_[r].figures + "</div>\n";
    }
    return text;
  }

  std::string maps() const {
    std::string figures;
    for (const RunResults& run : runs_)
      for (const RunPart& part : run.parts)
        for (const RunMap& map : part.maps) {
          const std::string name = readable(map.name);
          figures += fmt::format(
              "<figure><figcaption>{}</figcaption>{}<p class=\"soft\">{}</p></figure>\n",
              xml_escaped((runs_.size() > 1 ? run.label + ": " : "") + name),
              svg_of(MapPicture(
                  read_map(map.file),
                  {.name = name, .unit = map.unit, .title = {}, .ink = page_ink, .scale = {}})),
              xml_escaped(map.meaning));
        }
    return figures.empty() ? "" : "<div class=\"grid\">\n" + figures + "</div>\n";
  }

  std::string particles_json() const {
    std::string runs, maps;
    for (const RunSamples& one : samples_)
      if (!one.frames.empty()) runs += (runs.empty() ? "" : ",") + json_of(one, bounds_, scales_);
    for (const bool is_signed : {false, true}) {
      const ColourScale scale{.is_signed = is_signed};
      std::string colours;
      for (int k = 0; k < map_colours; ++k)
        colours += fmt::format("{}\"{}\"", k == 0 ? "" : ",",
                               hex_of(scale.colour(k / (map_colours - 1.0))));
      maps += (maps.empty() ? "[" : ",[") + colours + "]";
    }
    nlohmann::json fields = nlohmann::json::array();
    for (std::size_t f = 0; f < about_.size(); ++f) {
      const UnitScale unit =
          unit_scale(std::max(std::abs(scales_[f].low), std::abs(scales_[f].high)), about_[f].unit);
      fields.push_back({{"label", about_[f].label},
                        {"low", scales_[f].low},
                        {"high", scales_[f].high},
                        {"factor", unit.factor},
                        {"unit", unit.unit},
                        {"signed", scales_[f].is_signed}});
    }
    return fmt::format("{{\"fields\":{},\"maps\":[{}],\"runs\":[{}]}}", fields.dump(), maps, runs);
  }

  const std::vector<RunResults>& runs_;
  const ReportOptions& options_;
  std::vector<std::string> fields_;
  std::vector<RunSamples> samples_;
  std::vector<RunPictures> pictures_;
  std::vector<ColourScale> scales_;
  std::vector<FrameField> about_;
  Bounds bounds_;
};

}  // namespace

std::string report_page(const std::vector<RunResults>& runs, const ReportOptions& options) {
  return ReportPage(runs, options).fill();
}

}  // namespace lahar
