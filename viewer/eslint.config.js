import js from '@eslint/js';
import ts from 'typescript-eslint';

export default ts.config({ ignores: ['dist', 'node_modules'] }, js.configs.recommended, ...ts.configs.strict, {
  rules: {
    eqeqeq: 'error',
    'no-console': ['error', { allow: ['warn', 'error'] }],
    // Playwright requires a fixture's first argument to be a pattern.
    'no-empty-pattern': ['error', { allowObjectPatternsAsParameters: true }],
  },
});
