import js from "@eslint/js";
import globals from "globals";

export default [
  js.configs.recommended,
  {
    languageOptions: {ecmaVersion: 2022, sourceType: "module", globals: globals.browser},
    linterOptions: {reportUnusedDisableDirectives: "error"},
    rules: {
      curly: ["error", "multi-line"],
      eqeqeq: ["error", "always", {null: "ignore"}],
      "no-constant-binary-expression": "error",
      "no-else-return": "error",
      "no-implicit-coercion": ["error", {allow: ["!!"]}],
      "no-shadow": "error",
      "no-unused-vars": ["error", {argsIgnorePattern: "^_"}],
      "no-use-before-define": ["error", {functions: false, variables: false}],
      "no-var": "error",
      "object-shorthand": "error",
      "prefer-arrow-callback": "error",
      "prefer-const": "error",
      "prefer-template": "off",
    },
  },
  {files: ["tests/page/**"], languageOptions: {globals: globals.node}},
];
