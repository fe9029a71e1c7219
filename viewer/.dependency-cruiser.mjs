/** Each folder of src may use only those before it; no file or folder depends on itself through others. */
const order = ['wire', 'ui', 'model', 'net', 'render', 'live', 'board', 'hands', 'admin', 'drive', 'replay', 'pages'];

const upward = order.slice(0, -1).map((folder, k) => ({
  name: `${folder}-uses-a-later-folder`,
  severity: 'error',
  from: { path: `^src/${folder}/` },
  to: { path: `^src/(${order.slice(k + 1).join('|')})/` },
}));

export default {
  forbidden: [
    { name: 'circle-of-files', severity: 'error', from: {}, to: { circular: true } },
    { name: 'circle-of-folders', severity: 'error', scope: 'folder', from: {}, to: { circular: true } },
    ...upward,
    // A folder that the list omits is an error, too.
    { name: 'folder-without-a-place', severity: 'error', from: { path: '^src/', pathNot: `^src/(${order.join('|')})/` }, to: {} },
  ],
  options: { doNotFollow: { path: 'node_modules' }, tsPreCompilationDeps: true, tsConfig: { fileName: 'tsconfig.json' } },
};
