#include "bindings.hpp"
#include "sila/core/errors.hpp"
#include "sila/version.hpp"

namespace sila::python {

/// sila.errors is Python, so that its exceptions pickle; it is looked up only when something is thrown.
void bind_errors(nb::module_&) {
  nb::register_exception_translator([](const std::exception_ptr& thrown, void*) {
    try {
      std::rethrow_exception(thrown);
    } catch (const FormatError& error) {
      const nb::object type = nb::module_::import_("sila.errors").attr("FormatError");
      const nb::object value = type(error.path, error.line, error.expected, error.found);
      PyErr_SetObject(type.ptr(), value.ptr());
    } catch (const NumericalError& error) {
      const nb::object type = nb::module_::import_("sila.errors").attr("NumericalError");
      PyErr_SetString(type.ptr(), error.what());
    }
  });
}

}  // namespace sila::python

NB_MODULE(_sila, module) {
  module.doc() = "The C++ library behind the package sila.";
  module.attr("version") = SILA_VERSION;
  module.attr("revision") = std::string(sila::build_revision());
  for (sila::python::Bind* bind : sila::python::kBindings) bind(module);
}
