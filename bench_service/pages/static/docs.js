"use strict";
// Shows this service's own document; nothing is asked of any other host.
SwaggerUIBundle({ url: "/openapi.json", dom_id: "#swagger-ui", deepLinking: true, validatorUrl: null });
